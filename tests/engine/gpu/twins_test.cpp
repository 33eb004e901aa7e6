// What C++ and the compute kernels declare together, as the driver sees it.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <bit>
#include <set>

#include "engine/gpu/buffer.h"
#include "engine/gpu/egl_context.h"
#include "engine/gpu/kernels.h"
#include "engine/gpu/shader_text.h"
#include "kernels/contact/organ_table.h"
#include "kernels/finite/finite_energy.h"
#include "kernels/heat/brick_layout.h"
#include "kernels/heat/heat_device.h"
#include "kernels/heat/heat_parameters.h"
#include "kernels/smoke/smoke_device.h"
#include "kernels/smoke/smoke_passes.h"
#include "tests/engine/gpu/block_layout.h"

namespace viscera {
namespace {

#define MEMBER(name) VISCERA_MEMBER(Struct, name)

StructLayout bin_layout() {
  using Struct = BinParameters;
  return {sizeof(Struct),
          {MEMBER(origin), MEMBER(size), MEMBER(inverse_cell), MEMBER(particles), MEMBER(unused_a),
           MEMBER(unused_b)}};
}

StructLayout viscosity_layout() {
  using Struct = ViscosityParameters;
  return {sizeof(Struct),
          {MEMBER(inverse_square), MEMBER(viscosity), MEMBER(crowding), MEMBER(fill),
           MEMBER(most_excess), MEMBER(gas_drag), MEMBER(fewest_neighbours), MEMBER(laplacian),
           MEMBER(step), MEMBER(particles), MEMBER(unused_a), MEMBER(unused_b)}};
}

StructLayout wave_layout() {
  using Struct = SwirlWave;
  return {sizeof(Struct), {MEMBER(amplitude), MEMBER(wave_number)}};
}

StructLayout integrate_layout() {
  using Struct = IntegrateParameters;
  return {sizeof(Struct),
          {MEMBER(extent), MEMBER(step), MEMBER(white), MEMBER(entrainment), MEMBER(gravity),
           MEMBER(gas_temperature), MEMBER(cooling), MEMBER(turbulence), MEMBER(seed),
           MEMBER(substep), MEMBER(open_sides), MEMBER(waves), MEMBER(particles)}};
}

StructLayout triangle_layout() {
  using Struct = SurfaceTriangle;
  return {sizeof(Struct), {MEMBER(corners), MEMBER(motion), MEMBER(normals)}};
}

StructLayout capsule_layout() {
  using Struct = SmokeCapsule;
  return {sizeof(Struct), {MEMBER(from), MEMBER(to), MEMBER(from_motion), MEMBER(to_motion)}};
}

StructLayout collide_layout() {
  using Struct = CollideParameters;
  return {
      sizeof(Struct),
      {MEMBER(origin), MEMBER(size), MEMBER(inverse_cell), MEMBER(gap), MEMBER(friction),
       MEMBER(touch), MEMBER(kept), MEMBER(capsules), MEMBER(particles), MEMBER(rounds),
       MEMBER(extent), MEMBER(open_sides), MEMBER(unused_a), MEMBER(unused_b), MEMBER(unused_c)}};
}

StructLayout splat_layout() {
  using Struct = SplatParameters;
  return {sizeof(Struct),
          {MEMBER(size), MEMBER(inverse_voxel), MEMBER(first_square), MEMBER(growth),
           MEMBER(widest_square), MEMBER(mass_scale), MEMBER(heat_scale), MEMBER(momentum_scale),
           MEMBER(particles)}};
}

StructLayout heat_layout() {
  using Struct = HeatParameters;
  return {sizeof(Struct),
          {MEMBER(numbers.dry_conductivity),
           MEMBER(numbers.wet_conductivity),
           MEMBER(numbers.conductivity_slope),
           MEMBER(numbers.boiling),
           MEMBER(numbers.solids_capacity),
           MEMBER(numbers.water_capacity),
           MEMBER(numbers.lost_solids),
           MEMBER(numbers.drain),
           MEMBER(numbers.inverse_square),
           MEMBER(numbers.coagulation_exponent),
           MEMBER(numbers.coagulation_kelvin),
           MEMBER(numbers.collagen_exponent),
           MEMBER(numbers.collagen_kelvin),
           MEMBER(numbers.body),
           MEMBER(numbers.voxel),
           MEMBER(numbers.followed),
           MEMBER(latent_heat),
           MEMBER(water_mass),
           MEMBER(fumes_mass),
           MEMBER(pyrolysis_exponent),
           MEMBER(pyrolysis_kelvin),
           MEMBER(pyrolysis_heat),
           MEMBER(cooling),
           MEMBER(evaporation),
           MEMBER(resting_vapour),
           MEMBER(vapour_slope),
           MEMBER(unused_a),
           MEMBER(unused_b)}};
}

StructLayout heat_entry_layout() {
  using Struct = HeatEntry;
  return {sizeof(Struct), {MEMBER(slot), MEMBER(geometry), MEMBER(heated), MEMBER(beside)}};
}

StructLayout heat_sums_layout() {
  using Struct = HeatSums;
  return {sizeof(Struct),
          {MEMBER(latent), MEMBER(vapour), MEMBER(pyrolysis), MEMBER(gas), MEMBER(stored),
           MEMBER(greatest), MEMBER(vapours), MEMBER(changed), MEMBER(border)}};
}

StructLayout flows_layout() {
  using Struct = BrickFlows;
  return {sizeof(Struct), {MEMBER(living), MEMBER(boundary), MEMBER(source), MEMBER(fastest)}};
}

StructLayout finite_layout() {
  using Struct = FiniteEnergyParameters;
  return {sizeof(Struct),
          {MEMBER(mu), MEMBER(lambda), MEMBER(averaged), MEMBER(viscous), MEMBER(averages),
           MEMBER(changed), MEMBER(unused_a), MEMBER(unused_b)}};
}

StructLayout loss_layout() {
  using Struct = VoxelLoss;
  return {sizeof(Struct), {MEMBER(water), MEMBER(fumes), MEMBER(excess), MEMBER(unused)}};
}

StructLayout organ_layout() {
  using Struct = OrganEntry;
  return {sizeof(Struct),
          {MEMBER(first_group), MEMBER(first_tile), MEMBER(tile_stride), MEMBER(displacement),
           MEMBER(first_load), MEMBER(loads), MEMBER(vertices), MEMBER(first_slice),
           MEMBER(first_vertex), MEMBER(unused)}};
}

using Layouts = std::map<std::string, StructLayout>;

/// What C++ puts into the blocks of each kernel.
std::map<std::string, Layouts> kernel_layouts() {
  return {
      {"bin.comp", {{"Pass", bin_layout()}}},
      {"viscosity.comp", {{"Pass", viscosity_layout()}, {"Bins", bin_layout()}}},
      {"paper_viscosity.comp", {{"Pass", viscosity_layout()}, {"Bins", bin_layout()}}},
      {"integrate.comp", {{"Pass", integrate_layout()}, {"Waves", wave_layout()}}},
      {"collide.comp",
       {{"Pass", collide_layout()},
        {"Triangles", triangle_layout()},
        {"Capsules", capsule_layout()}}},
      {"splat.comp", {{"Pass", splat_layout()}}},
      {"bioheat_advance.comp", {{"Pass", heat_layout()}, {"Table", heat_entry_layout()}}},
      {"bioheat_rates.comp",
       {{"Pass", heat_layout()},
        {"Table", heat_entry_layout()},
        {"Sums", heat_sums_layout()},
        {"Flows", flows_layout()}}},
      {"bioheat_settle.comp",
       {{"Pass", heat_layout()},
        {"Table", heat_entry_layout()},
        {"Sums", heat_sums_layout()},
        {"Lost", loss_layout()}}},
      {"finite_energy.comp", {{"Pass", finite_layout()}}},
      {"column_sums.comp", {{"Table", organ_layout()}}},
      {"deformation.comp", {{"Table", organ_layout()}}},
  };
}

class TwinsTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = EglContext::create();
    if (!made) GTEST_SKIP() << made.error().text();
    context_ = *std::move(made);
    RecordProperty("device", context_->device());
  }
  static Program compile(const std::string& text) {
    Result<Program> program = Program::create({{GL_COMPUTE_SHADER, {{"twin.comp", text}}, {}}});
    if (!program) throw std::runtime_error(program.error().text());
    return *std::move(program);
  }
  std::unique_ptr<EglContext> context_;
};

TEST_F(TwinsTest, EveryBlockOfEveryKernelLiesAsInCpp) {
  const std::map<std::string, Layouts> layouts = kernel_layouts();
  int kernels = 0;
  std::set<std::string> covered;
  for (const ShaderFile& file : embedded_kernels()) {
    if (!file.name.ends_with(".comp")) continue;
    const auto expected = layouts.find(file.name);
    for (const std::string& pass : passes_of(file)) {
      SCOPED_TRACE(file.name + " " + pass);
      const Result<Program> program = load_kernel(file.name, pass);
      ASSERT_TRUE(program) << program.error().text();
      std::vector<std::string> seen;
      const std::vector<std::string> complaints =
          compare_blocks(*program, expected != layouts.end() ? expected->second : Layouts{}, &seen);
      for (const std::string& complaint : complaints) ADD_FAILURE() << complaint;
      for (const std::string& block : seen) covered.insert(file.name + " " + block);
      ++kernels;
    }
  }
  EXPECT_GE(kernels, 31);
  // No layout stands here for a block that has gone.
  for (const auto& [file, blocks] : layouts) {
    for (const auto& [block, layout] : blocks)
      EXPECT_TRUE(covered.contains(file + " " + block)) << file << " " << block;
  }
}

/// The uniform block of bin.comp by other declarations.
std::vector<std::string> complaints_of(const Program& program) {
  return compare_blocks(program, {{"Pass", bin_layout()}});
}

std::string bins_declared(const std::string& members) {
  return "layout(local_size_x = 1) in;\nstruct BinParameters {" + members +
         "};\nlayout(std140, binding = 0) uniform Pass { BinParameters grid; };\n"
         "layout(std430, binding = 0) buffer Out { float result[]; };\n"
         "void main() { result[0] = grid.inverse_cell; }\n";
}

TEST_F(TwinsTest, SwappedMembersAreFound) {
  const std::vector<std::string> found = complaints_of(
      compile(bins_declared("ivec4 size; vec4 origin; float inverse_cell; uint particles; "
                            "uint unused_a, unused_b;")));
  EXPECT_EQ(found, (std::vector<std::string>{
                       "Pass.origin: vec4 at byte 16, 16 long; in C++ vec4 at byte 0, 16 long",
                       "Pass.size: ivec4 at byte 0, 16 long; in C++ ivec4 at byte 16, 16 long"}));
}

TEST_F(TwinsTest, AnotherTypeOfTheSameSizeIsFound) {
  const std::vector<std::string> found = complaints_of(
      compile(bins_declared("vec4 origin; ivec4 size; float inverse_cell; float particles; "
                            "uint unused_a, unused_b;")));
  EXPECT_EQ(found, (std::vector<std::string>{"Pass.particles: float at byte 36, 4 long; in C++ "
                                             "uint at byte 36, 4 long"}));
}

TEST_F(TwinsTest, MissingAndAddedMembersAreFound) {
  const std::vector<std::string> found = complaints_of(compile(bins_declared(
      "vec4 origin; ivec4 size; float inverse_cell; uint count; uint unused_a, unused_b;")));
  EXPECT_EQ(found,
            (std::vector<std::string>{"Pass.count: not in C++", "Pass.particles: in C++ alone"}));
}

TEST_F(TwinsTest, ArrayThatStd140WidensIsFound) {
  const std::vector<std::string> found = complaints_of(compile(bins_declared(
      "vec4 origin; ivec4 size; float inverse_cell; uint particles; uint unused_a[2];")));
  EXPECT_EQ(found.size(), 3u);  // its size, the other that is missing, the block's size
}

TEST_F(TwinsTest, BlockThatNothingIsKnownOfIsFound) {
  const Program program = compile(
      "layout(local_size_x = 1) in;\nstruct Thing { vec4 a; float b; };\n"
      "layout(std430, binding = 0) buffer Things { Thing things[]; };\n"
      "void main() { things[0].b = 1.0; }\n");
  EXPECT_EQ(compare_blocks(program, {}),
            (std::vector<std::string>{"Things.a: nothing in C++ is known for it",
                                      "Things.b: nothing in C++ is known for it"}));
}

TEST_F(TwinsTest, ElementsOfAnotherDistanceAreFound) {
  const Program program = compile(
      "layout(local_size_x = 1) in;\nstruct SwirlWave { vec4 amplitude, wave_number, more; };\n"
      "layout(std430, binding = 0) buffer Waves { SwirlWave waves[]; };\n"
      "layout(std430, binding = 1) buffer Places { vec3 places[]; };\n"
      "void main() { waves[0].more.x = places[1].x; }\n");
  EXPECT_EQ(compare_blocks(program, {{"Waves", wave_layout()}}),
            (std::vector<std::string>{"Places.places: a vec3 every 16 bytes",
                                      "Waves.amplitude: one every 48 bytes, in C++ every 32",
                                      "Waves.more: not in C++",
                                      "Waves.wave_number: one every 48 bytes, in C++ every 32"}));
}

TEST_F(TwinsTest, ConstantsAndEnumeratorsHaveTheSameBits) {
  ShaderText text(embedded_kernels(), "kernel", "CMakeLists.txt");
  for (const char* header : {"smoke_passes.h", "smoke_device.h", "heat_parameters.h",
                             "heat_device.h", "brick_layout.h", "organ_table.h"}) {
    ASSERT_TRUE(text.add(header)) << header;
  }
  struct Constant {
    const char* glsl;
    std::uint32_t bits;
  };
  const auto real = [](double value) {
    return std::bit_cast<std::uint32_t>(static_cast<float>(value));
  };
  const auto word = [](auto value) { return static_cast<std::uint32_t>(value); };
  const std::vector<Constant> constants = {
      {"floatBitsToUint(kLeastOfDensity)", real(kLeastOfDensity)},
      {"floatBitsToUint(kLeastOfMoment)", real(kLeastOfMoment)},
      {"floatBitsToUint(kMostRatio)", real(kMostRatio)},
      {"floatBitsToUint(kGapSlack)", real(kGapSlack)},
      {"floatBitsToUint(kWidestSplat)", real(kWidestSplat)},
      {"floatBitsToUint(kAtBoiling)", real(kAtBoiling)},
      {"floatBitsToUint(kDoseCounts)", real(kDoseCounts)},
      {"floatBitsToUint(kDoseSlope)", real(kDoseSlope)},
      {"floatBitsToUint(kLethalTime)", real(kLethalTime)},
      {"floatBitsToUint(kMostCollagen)", real(kMostCollagen)},
      {"floatBitsToUint(kHarmedDose)", real(kHarmedDose)},
      {"floatBitsToUint(float(kDriedWater))", real(kDriedWater)},
      {"floatBitsToUint(float(kLeastWater))", real(kLeastWater)},
      {"floatBitsToUint(float(kLeastCharring))", real(kLeastCharring)},
      {"unpackDouble2x32(kLeastCondition).x",
       word(std::bit_cast<std::uint64_t>(kLeastCondition) & 0xffff'ffffu)},
      {"unpackDouble2x32(kLeastCondition).y",
       word(std::bit_cast<std::uint64_t>(kLeastCondition) >> 32)},
      {"kPairwise", word(Laplacian::kPairwise)},
      {"kPaper", word(Laplacian::kPaper)},
      {"kAirborne", word(SmokeFate::kAirborne)},
      {"kDeposited", word(SmokeFate::kDeposited)},
      {"kOpenLowX", word(kOpenLowX)},
      {"kOpenHighZ", word(kOpenHighZ)},
      {"kOpenAll", word(kOpenAll)},
      {"kIsolatedWord", word(kIsolatedWord)},
      {"kCounterWords", word(kCounterWords)},
      {"kScanBlock", word(kScanBlock)},
      {"kHarmedForGood", word(kHarmedForGood)},
      {"kExcessChanged", word(kExcessChanged)},
      {"kPerfused", word(kPerfused)},
      {"kGeometryWords", word(kGeometryWords)},
      {"kTileRows", word(kTileRows)},
  };
  std::string body =
      "layout(local_size_x = 1) in;\n"
      "layout(std430, binding = 0) buffer Out { uint result[]; };\nvoid main() {\n";
  for (std::size_t i = 0; i < constants.size(); ++i) {
    body += "result[" + std::to_string(i) + "] = " + constants[i].glsl + ";\n";
  }
  std::vector<ShaderFile> files = text.take();
  files.push_back({"constants.comp", body + "}\n"});
  const Result<Program> program = Program::create({{GL_COMPUTE_SHADER, files, {}}});
  ASSERT_TRUE(program) << program.error().text();
  Buffer result;
  result.allocate(constants.size() * sizeof(std::uint32_t));
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, result.id());
  program->use();
  glDispatchCompute(1, 1, 1);
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  const std::vector<std::uint32_t> words = result.download<std::uint32_t>(0, constants.size());
  for (std::size_t i = 0; i < constants.size(); ++i) {
    EXPECT_EQ(words[i], constants[i].bits) << constants[i].glsl;
  }
}

}  // namespace
}  // namespace viscera
