#include "engine/gpu/gpu_deformation.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <stdexcept>

#include "engine/gpu/egl_context.h"
#include "engine/gpu/kernels.h"
#include "engine/gpu/memory_bandwidth.h"
#include "engine/gpu/texture.h"
#include "engine/verification/ring_organ.h"

namespace viscera {
namespace {

constexpr double kUnit = 0x1p-24;  // rounding of single precision
const IsotropicMaterial kTissue{5e3, 0.45};

/// Loads on an organ, kept while GpuLoads points at them.
struct Load {
  ContactResponse response;
  std::vector<int> near_vertices;
  std::vector<Vec3f> near_field;

  GpuLoads on(std::size_t organ) const {
    return {organ, response.touched, response.loads, near_vertices, near_field};
  }
};

Load pressed(int first, int count, double force = 0.05) {
  Load load;
  for (int j = 0; j < count; ++j) {
    load.response.touched.push_back(first + j);
    load.response.loads.emplace_back(force * std::sin(1.0 + j), -force * std::cos(2.0 * j),
                                     -force / (1.0 + j));
  }
  return load;
}

struct Shape {
  std::vector<float> displacements;
  std::vector<Vec3f> positions, normals;
  bool operator==(const Shape&) const = default;
};

Shape read(const GpuDeformation& gpu, std::size_t organ) {
  return {gpu.read_displacements(organ), gpu.read_positions(organ), gpu.read_normals(organ)};
}

/// The CPU's answer; the near field comes with its own cells.
Shape on_cpu(const RingOrgan& organ, const Load& load, std::span<const NearField> near_fields = {},
             std::span<const ContactCell> cells = {}, std::span<const Vec3> forces = {}) {
  Shape shape;
  place_displacements(organ.compliance, load.response, shape.displacements);
  deform_drawn_surface(organ.drawn, shape.displacements, near_fields, cells, forces,
                       shape.positions, shape.normals);
  return shape;
}

/// Each component's error is at most its number of roundings times the unit times the sum of the
/// terms' sizes, for either side: terms and their sum within a triple 3, then one a triple on the
/// CPU, and on the GPU at most one a triple and 8 for adding the parts.
void expect_same_displacements(const RingOrgan& organ, const Load& load,
                               const std::vector<float>& cpu, const std::vector<float>& gpu) {
  const SurfaceCompliance& compliance = organ.compliance;
  ASSERT_EQ(gpu.size(), compliance.rows());
  const double roundings = 2.0 * static_cast<double>(load.response.touched.size()) + 14.0;
  for (std::size_t row = 0; row < compliance.rows(); ++row) {
    double sizes = 0.0;
    for (std::size_t j = 0; j < load.response.touched.size(); ++j) {
      for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t column = 3 * static_cast<std::size_t>(load.response.touched[j]) + a;
        sizes += std::abs(compliance.columns[column * compliance.rows() + row] *
                          load.response.loads[j][static_cast<int>(a)]);
      }
    }
    const double bound = 1.001 * roundings * kUnit * sizes + std::numeric_limits<float>::min();
    ASSERT_LE(std::abs(static_cast<double>(gpu[row]) - cpu[row]), bound) << "row " << row;
  }
}

/// Positions: what the displacements differ by (weights add up to 1, none is far above it), and the
/// roundings of some twenty terms as large as the greatest displacement, of the rest place and of
/// the sum. Normals: an error d of the corners turns a triangle of least altitude a by at most
/// about 4 d / a.
void expect_same_surface(const RingOrgan& organ, const Shape& cpu, const Shape& gpu) {
  ASSERT_EQ(gpu.positions.size(), cpu.positions.size());
  float greatest = 0.0f, apart = 0.0f;
  for (std::size_t i = 0; i < cpu.displacements.size(); ++i) {
    greatest = std::max(greatest, std::abs(cpu.displacements[i]));
    apart = std::max(apart, std::abs(cpu.displacements[i] - gpu.displacements[i]));
  }
  double moved_apart = 0.0;
  for (std::size_t v = 0; v < cpu.positions.size(); ++v) {
    const double bound =
        3.0 * apart + kUnit * (40.0 * greatest + 4.0 * cpu.positions[v].cast<double>().norm());
    const double off = (gpu.positions[v] - cpu.positions[v]).cast<double>().norm();
    ASSERT_LE(off, bound) << "vertex " << v;
    moved_apart = std::max(moved_apart, off);
  }
  double altitude = std::numeric_limits<double>::max();
  for (const auto& t : organ.surface.triangles) {
    const auto corner = [&](std::size_t a) -> Vec3 {
      return cpu.positions[static_cast<std::size_t>(t[a])].cast<double>();
    };
    const Vec3 u = corner(1) - corner(0), v = corner(2) - corner(0);
    const double longest = std::max({u.norm(), v.norm(), (v - u).norm()});
    altitude = std::min(altitude, u.cross(v).norm() / longest);
  }
  for (std::size_t v = 0; v < cpu.normals.size(); ++v) {
    ASSERT_NEAR(gpu.normals[v].norm(), 1.0f, 8.0 * kUnit);
    ASSERT_LE((gpu.normals[v] - cpu.normals[v]).cast<double>().norm(),
              4.0 * moved_apart / altitude + 128.0 * kUnit)
        << "vertex " << v;
  }
}

class GpuDeformationTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = EglContext::create();
    if (!made) GTEST_SKIP() << made.error().text();
    context_ = *std::move(made);
    RecordProperty("device", context_->device());
  }

  /// Three organs; neither rows nor vertices of any are multiples of a work group.
  static const std::vector<const RingOrgan*>& rings() {
    static const auto large = make_ring_organ({37, 13, 71, 23, 41});
    static const auto small = make_ring_organ({11, 5, 17, 9, 7});
    static const auto middle = make_ring_organ({24, 10, 60, 25, 30});
    static const std::vector<const RingOrgan*> all = {large.get(), small.get(), middle.get()};
    return all;
  }
  static std::vector<GpuOrgan> organs() {
    std::vector<GpuOrgan> given;
    for (const RingOrgan* ring : rings()) {
      given.push_back({"ring" + std::to_string(given.size()), &ring->compliance, &ring->drawn});
    }
    return given;
  }
  static GpuDeformation create(std::span<const GpuOrgan> given,
                               GpuLimits limits = GpuLimits::of_device()) {
    Result<GpuDeformation> made = GpuDeformation::create(given, limits);
    if (!made) throw std::runtime_error(made.error().text());
    return *std::move(made);
  }
  static void deform(GpuDeformation& gpu, const std::vector<GpuLoads>& loads) {
    const Result<void> done = gpu.deform(loads);
    ASSERT_TRUE(done) << done.error().text();
  }

  std::unique_ptr<EglContext> context_;
};

TEST_F(GpuDeformationTest, DisplacementsPositionsAndNormalsOfSeveralOrgansMatchTheCpu) {
  GpuDeformation gpu = create(organs());
  // Fewer loads than threads share them, as many as all of them, and in between.
  const std::vector<Load> loads = {pressed(3, 38), pressed(2, 3), pressed(0, 17)};
  deform(gpu, {loads[0].on(0), loads[1].on(1), loads[2].on(2)});
  for (std::size_t o = 0; o < 3; ++o) {
    SCOPED_TRACE("organ " + std::to_string(o));
    const Shape cpu = on_cpu(*rings()[o], loads[o]), found = read(gpu, o);
    EXPECT_NE(cpu.positions[0], rings()[o]->surface.vertices[0].cast<float>());
    expect_same_displacements(*rings()[o], loads[o], cpu.displacements, found.displacements);
    expect_same_surface(*rings()[o], cpu, found);
  }
}

TEST_F(GpuDeformationTest, EveryNumberOfLoadsIsSummedWhole) {
  GpuDeformation gpu = create(organs());
  for (int count = 0; count <= 41; ++count) {
    const Load load = pressed(41 - count, count);
    deform(gpu, {load.on(0)});
    std::vector<float> cpu;
    place_displacements(rings()[0]->compliance, load.response, cpu);
    expect_same_displacements(*rings()[0], load, cpu, gpu.read_displacements(0));
  }
}

TEST_F(GpuDeformationTest, ColumnsInHalfPrecisionMatchTheCpusBesideOthersInSingle) {
  std::vector<HalfColumns> halves;
  for (const RingOrgan* ring : rings()) halves.push_back(half_precision(ring->compliance));
  std::vector<GpuOrgan> given = organs();
  given[0].half = &halves[0];
  given[2].half = &halves[2];
  given[2].compliance = nullptr;  // a run keeps only the part for forces
  GpuDeformation gpu = create(given);
  EXPECT_EQ(gpu.shards(), 2u);
  const std::vector<Load> loads = {pressed(3, 38), pressed(2, 3), pressed(0, 17)};
  deform(gpu, {loads[0].on(0), loads[1].on(1), loads[2].on(2)});
  for (std::size_t o = 0; o < 3; ++o) {
    std::vector<float> cpu;
    if (given[o].half == nullptr) {
      place_displacements(rings()[o]->compliance, loads[o].response, cpu);
    } else {
      place_displacements(*given[o].half, loads[o].response, cpu);
    }
    expect_same_displacements(*rings()[o], loads[o], cpu, gpu.read_displacements(o));
  }
  halves[0].entries.pop_back();
  EXPECT_FALSE(GpuDeformation::create(given));
}

TEST_F(GpuDeformationTest, NearFieldIsAddedWhereTheCpuFindsIt) {
  const RingOrgan& ring = *rings()[0];
  Load load = pressed(5, 4);
  std::vector<ContactCell> cells(7);
  std::vector<Vec3> forces;
  std::vector<NearField> near_fields;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    cells[k].position = ring.surface.vertices[40 + k];
    cells[k].normal = ring.drawn.rest_normals[40 + k];
    cells[k].area = 1e-6;
    near_fields.emplace_back(kTissue, 4e-3);
    forces.push_back(-0.02 * static_cast<double>(k) * cells[k].normal);
  }
  near_field_on_surface(ring.drawn, near_fields, cells, forces, load.near_vertices,
                        load.near_field);
  ASSERT_GT(load.near_vertices.size(), 20u);
  ASSERT_LT(load.near_vertices.size(), ring.surface.vertices.size());
  GpuDeformation gpu = create(organs());
  const Load other = pressed(1, 2);
  deform(gpu, {other.on(1), load.on(0)});
  const Shape cpu = on_cpu(ring, load, near_fields, cells, forces);
  const Shape found = read(gpu, 0);
  const int vertex = load.near_vertices[0];
  EXPECT_GT((cpu.positions[static_cast<std::size_t>(vertex)] -
             on_cpu(ring, load).positions[static_cast<std::size_t>(vertex)])
                .norm(),
            1e-7f);
  expect_same_surface(ring, cpu, found);
  expect_same_surface(*rings()[1], on_cpu(*rings()[1], other), read(gpu, 1));
}

TEST_F(GpuDeformationTest, OrganWithoutLoadLiesAtRest) {
  GpuDeformation gpu = create(organs());
  const auto expect_rest = [&](std::size_t o) {
    const Shape found = read(gpu, o);
    for (const float u : found.displacements) ASSERT_EQ(u, 0.0f);
    for (std::size_t v = 0; v < found.positions.size(); ++v) {
      ASSERT_EQ(found.positions[v], rings()[o]->surface.vertices[v].cast<float>());
      ASSERT_LT((found.normals[v].cast<double>() - rings()[o]->drawn.rest_normals[v]).norm(), 1e-4);
    }
  };
  for (std::size_t o = 0; o < 3; ++o) expect_rest(o);  // before any frame
  const Load some = pressed(0, 5), none;
  deform(gpu, {some.on(0), some.on(1)});
  deform(gpu, {none.on(1), some.on(2)});
  expect_rest(1);
}

TEST_F(GpuDeformationTest, OrganThatIsNotNamedKeepsItsShape) {
  GpuDeformation gpu = create(organs());
  const Load some = pressed(0, 5), other = pressed(1, 6);
  deform(gpu, {some.on(0)});
  const Shape before = read(gpu, 0);
  deform(gpu, {other.on(1), other.on(2)});
  deform(gpu, {});
  EXPECT_EQ(read(gpu, 0), before);
}

TEST_F(GpuDeformationTest, SameBitsTwiceAloneAndTogetherAndInAnyOrder) {
  const auto expect_same = [](const Shape& found, const Shape& first) {
    EXPECT_EQ(found.displacements, first.displacements);
    EXPECT_EQ(found.positions, first.positions);
    EXPECT_EQ(found.normals, first.normals);
  };
  GpuDeformation gpu = create(organs());
  const std::vector<Load> loads = {pressed(3, 38), pressed(2, 3), pressed(0, 17)};
  deform(gpu, {loads[0].on(0), loads[1].on(1), loads[2].on(2)});
  const std::vector<Shape> first = {read(gpu, 0), read(gpu, 1), read(gpu, 2)};
  deform(gpu, {loads[2].on(2), loads[1].on(0)});
  deform(gpu, {loads[2].on(2), loads[0].on(0), loads[1].on(1)});
  for (std::size_t o = 0; o < 3; ++o) expect_same(read(gpu, o), first[o]);
  for (std::size_t o = 0; o < 3; ++o) deform(gpu, {loads[o].on(o)});
  for (std::size_t o = 0; o < 3; ++o) expect_same(read(gpu, o), first[o]);
  GpuDeformation another = create(organs());
  deform(another, {loads[0].on(0), loads[1].on(1), loads[2].on(2)});
  for (std::size_t o = 0; o < 3; ++o) expect_same(read(another, o), first[o]);
}

TEST_F(GpuDeformationTest, InstancesShareTheirModelAndMoveApart) {
  const RingOrgan& ring = *rings()[0];
  const GpuOrgan organ{"ring", &ring.compliance, &ring.drawn};
  const std::size_t one = create(std::vector<GpuOrgan>(1, organ)).bytes();
  GpuDeformation gpu = create(std::vector<GpuOrgan>(4, organ));
  // Displacements of the places, padded to whole tiles, positions and normals.
  const std::size_t each = 4 * (ring.compliance.rows() + 128) + 24 * ring.surface.vertices.size();
  EXPECT_LE(gpu.bytes(), one + 3 * each);
  const Load a = pressed(0, 5), b = pressed(7, 9);
  deform(gpu, {a.on(1), b.on(3)});
  expect_same_surface(ring, on_cpu(ring, a), read(gpu, 1));
  expect_same_surface(ring, on_cpu(ring, b), read(gpu, 3));
  EXPECT_EQ(read(gpu, 0), read(gpu, 2));
  EXPECT_EQ(gpu.first_vertex(3), 3 * ring.surface.vertices.size());
}

TEST_F(GpuDeformationTest, ComplianceLargerThanAStorageBufferIsSplitAndGivesTheSameBits) {
  const auto wide = make_ring_organ({37, 13, 20, 9, 200});
  const HalfColumns half = half_precision(wide->compliance);
  const std::vector<GpuOrgan> given = {{"wide", &wide->compliance, &wide->drawn},
                                       {"half", nullptr, &wide->drawn, &half},
                                       {"small", &rings()[1]->compliance, &rings()[1]->drawn}};
  GpuDeformation whole = create(given);
  EXPECT_EQ(whole.shards(), 2u);
  // Twelve tiles of 307,200 bytes, two of 10,752, and twelve of 153,600 in half precision.
  GpuLimits limits = GpuLimits::of_device();
  limits.block_bytes = 700'000;
  GpuDeformation split = create(given, limits);
  EXPECT_EQ(split.shards(), 9u);
  const Load load = pressed(2, 5);
  for (GpuDeformation* gpu : {&whole, &split}) deform(*gpu, {load.on(1), load.on(2), load.on(0)});
  for (std::size_t o = 0; o < 3; ++o) {
    EXPECT_EQ(split.refusal(o), "");
    EXPECT_EQ(read(split, o), read(whole, o));
  }
}

TEST_F(GpuDeformationTest, MoreGroupsThanAnAxisTakesGiveTheSameBits) {
  GpuDeformation whole = create(organs());
  GpuLimits limits = GpuLimits::of_device();
  limits.groups_per_axis = 5;
  GpuDeformation folded = create(organs(), limits);
  Load load = pressed(2, 5);
  load.near_vertices.resize(120);
  std::iota(load.near_vertices.begin(), load.near_vertices.end(), 3);
  load.near_field.assign(120, Vec3f(1e-4f, 2e-4f, -1e-4f));
  for (GpuDeformation* gpu : {&whole, &folded}) deform(*gpu, {load.on(2), load.on(1), load.on(0)});
  for (std::size_t o = 0; o < 3; ++o) EXPECT_EQ(read(folded, o), read(whole, o));
}

TEST_F(GpuDeformationTest, OrganBeyondTheLimitsStaysOnTheCpuWithAReason) {
  GpuLimits limits = GpuLimits::of_device();
  const Load load = pressed(1, 3);
  const auto expect_only_small = [&](std::size_t bytes, const std::string& why) {
    limits.block_bytes = bytes;
    GpuDeformation gpu = create(organs(), limits);
    EXPECT_NE(gpu.refusal(0).find("ring0: "), std::string::npos);
    EXPECT_NE(gpu.refusal(0).find(why), std::string::npos) << gpu.refusal(0);
    EXPECT_NE(gpu.refusal(0).find("stays on the CPU"), std::string::npos);
    ASSERT_EQ(gpu.refusal(1), "");
    const Result<void> refused = gpu.deform(std::vector<GpuLoads>{load.on(0)});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().text(), gpu.refusal(0));
    EXPECT_TRUE(gpu.read_positions(0).empty());
    deform(gpu, {load.on(1)});
    expect_same_surface(*rings()[1], on_cpu(*rings()[1], load), read(gpu, 1));
  };
  expect_only_small(60'000, "128 rows of its compliance would make a storage buffer of 1 MB");
  expect_only_small(100'000, "what carries its 1633 vertices would make a storage buffer");
}

TEST_F(GpuDeformationTest, InstancesWhoseShapesDontFitOneBufferAreRefused) {
  const RingOrgan& ring = *rings()[1];
  const std::vector<GpuOrgan> given(40, {"ring", &ring.compliance, &ring.drawn});
  GpuLimits limits = GpuLimits::of_device();
  limits.block_bytes = 36'000;
  GpuDeformation gpu = create(given, limits);
  ASSERT_EQ(gpu.refusal(0), "");
  EXPECT_NE(gpu.refusal(39).find("the displacements of all organs so far"), std::string::npos)
      << gpu.refusal(39);
}

TEST_F(GpuDeformationTest, WrongLoadsAreRefusedAndChangeNothing) {
  GpuDeformation gpu = create(organs());
  const Load good = pressed(0, 5);
  deform(gpu, {good.on(0), good.on(1)});
  const Shape before = read(gpu, 1);
  const auto refused = [&](const std::vector<GpuLoads>& loads, const std::string& why) {
    const Result<void> done = gpu.deform(loads);
    ASSERT_FALSE(done);
    EXPECT_NE(done.error().text().find(why), std::string::npos) << done.error().text();
    EXPECT_EQ(read(gpu, 1), before);
  };
  const Load other = pressed(1, 4);
  refused({other.on(1), other.on(3)}, "organ 3: expected less than 3");
  refused({other.on(1), other.on(1)}, "organ ring1: deformed twice in a frame");
  Load bad = pressed(4, 4);
  refused({other.on(1), bad.on(1)}, "twice");
  refused({bad.on(1)}, "load on touchable place 7, expected less than 7");
  bad = pressed(-1, 2);
  refused({bad.on(1)}, "load on touchable place -1");
  bad = pressed(0, 3);
  bad.response.loads.pop_back();
  refused({bad.on(1)}, "2 loads on 3 places");
  bad = pressed(0, 3);
  bad.near_vertices = {5, 5};
  refused({bad.on(1)}, "0 near displacements of 2 vertices");
  bad.near_field.assign(2, Vec3f::Zero());
  refused({bad.on(1)}, "near field at vertex 5, expected ascending");
  bad.near_vertices = {5, 153};
  refused({bad.on(1)}, "near field at vertex 153, expected ascending and less than 153");
}

TEST_F(GpuDeformationTest, OrganWhosePartsDontFitIsRefused) {
  const RingOrgan& ring = *rings()[1];
  SurfaceCompliance cut = ring.compliance;
  cut.columns.pop_back();
  const auto error_of = [](const GpuOrgan& organ) {
    const auto made = GpuDeformation::create(std::vector<GpuOrgan>{organ});
    return made ? std::string() : made.error().text();
  };
  EXPECT_EQ(error_of({"liver", &cut, &ring.drawn}),
            "organ liver: 3464 entries of its compliance, expected 3465");
  EXPECT_EQ(error_of({"liver", &ring.compliance, nullptr}),
            "organ liver: expected a compliance and a drawn surface, found none");
  EXPECT_NE(error_of({"liver", &ring.compliance, &rings()[0]->drawn}).find("carried by place"),
            std::string::npos);
}

TEST_F(GpuDeformationTest, ShapesAreDrawnFromWhereTheyLieWithoutComingBack) {
  GLint storage_blocks = 0;
  glGetIntegerv(GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS, &storage_blocks);
  if (storage_blocks < 1) GTEST_SKIP() << "vertex shaders write no storage here";
  // A vertex shader that notes what it was given.
  const ShaderFile note = {"note.vert",
                           "layout(location = 0) in vec3 position;\n"
                           "layout(location = 1) in vec3 normal;\n"
                           "layout(std430, binding = 0) writeonly buffer Seen { float seen[]; };\n"
                           "void main() {\n"
                           "  uint at = 6u * uint(gl_VertexID);\n"
                           "  for (int a = 0; a < 3; ++a) {\n"
                           "    seen[at + uint(a)] = position[a];\n"
                           "    seen[at + 3u + uint(a)] = normal[a];\n"
                           "  }\n"
                           "  gl_Position = vec4(position, 1.0);\n"
                           "}\n"};
  const ShaderFile none = {"none.frag", "void main() {}\n"};
  Result<Program> program =
      Program::create({{GL_VERTEX_SHADER, {note}, {}}, {GL_FRAGMENT_SHADER, {none}, {}}});
  ASSERT_TRUE(program) << program.error().text();
  const Texture colour(GL_RGBA8, 4, 4);
  const Framebuffer target({&colour}, nullptr);
  target.bind();

  GpuDeformation gpu = create(organs());
  const std::size_t count = rings()[1]->surface.vertices.size();
  const std::size_t offset = gpu.first_vertex(1) * sizeof(Vec3f);
  VertexArray array;
  array.attribute(0, gpu.positions(), 3, sizeof(Vec3f), offset);
  array.attribute(1, gpu.normals(), 3, sizeof(Vec3f), offset);
  Buffer seen;
  seen.allocate(6 * count * sizeof(float));
  const Load load = pressed(1, 5);
  deform(gpu, {load.on(0), load.on(1)});
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, seen.id());
  glBindVertexArray(array.id());
  program->use();
  glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(count));
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  const std::vector<Vec3f> drawn = seen.download<Vec3f>(0, 2 * count);
  const Shape found = read(gpu, 1);
  for (std::size_t v = 0; v < count; ++v) {
    ASSERT_EQ(drawn[2 * v], found.positions[v]);
    ASSERT_EQ(drawn[2 * v + 1], found.normals[v]);
  }
}

TEST_F(GpuDeformationTest, PassesAreTimedByName) {
  GpuDeformation gpu = create(organs());
  const Load load = pressed(0, 5);
  PassTimer timer;
  timer.start();
  const std::vector<GpuLoads> loads = {load.on(0)};
  ASSERT_TRUE(gpu.deform(loads, &timer));
  std::vector<std::string> names;
  for (const PassTime& pass : timer.finish()) names.push_back(pass.name);
  EXPECT_EQ(names, (std::vector<std::string>{"upload", "product", "carry", "near", "normals"}));
}

TEST_F(GpuDeformationTest, BandwidthIsMeasuredOnTheDevice) {
  const Result<MemoryBandwidth> found = measure_memory_bandwidth(1 << 20, 4 << 20, 3);
  ASSERT_TRUE(found) << found.error().text();
  EXPECT_EQ(found->bytes, 1u << 20);
  EXPECT_GT(found->read, 1e6);
  EXPECT_GT(found->copy, 1e6);
  EXPECT_LT(found->read, 1e14);
  EXPECT_FALSE(measure_memory_bandwidth(0, 0, 3));
}

TEST_F(GpuDeformationTest, KernelThatIsNotInTheProgramIsNamed) {
  const Result<Program> none = load_kernel("nothing.comp");
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().text().find("kernel nothing.comp: not in the program"), std::string::npos);
}

TEST_F(GpuDeformationTest, PassThatAKernelDoesntListIsNamedWithThoseItDoes) {
  const Result<Program> none = load_kernel("deformation.comp", "CARY");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().text(),
            "kernel deformation.comp: pass 'CARY', expected one of 'CARRY' 'NEAR' 'NORMALS'");
}

}  // namespace
}  // namespace viscera
