#include "engine/gpu/gpu_deformation.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <set>

#include "engine/gpu/kernels.h"

namespace viscera {

namespace {

using Pair = std::array<std::uint32_t, 2>;
using Quad = std::array<std::uint32_t, 4>;

std::size_t round_up(std::size_t count, std::size_t multiple) {
  return (count + multiple - 1) / multiple * multiple;
}

std::size_t parts_of(std::size_t count, std::size_t size) {
  return (count + size - 1) / size;
}

std::uint32_t bits(float value) {
  return std::bit_cast<std::uint32_t>(value);
}
std::uint32_t word(std::size_t value) {
  return static_cast<std::uint32_t>(value);
}

/// Rows of different length in slices of kSlice, as deformation.comp reads them.
struct SlicedRows {
  std::vector<std::uint32_t> begin{0};  // of each slice; all models one after another
  std::vector<Pair> entries;

  std::size_t slices() const { return begin.size() - 1; }
  /// Takes back what was appended after these slices.
  void cut(std::size_t slices) {
    begin.resize(slices + 1);
    entries.resize(begin.back());
  }

  /// `length(row)`, `entry(row, k)`, and for the places beyond a row's end `padding(row)`.
  template <class Length, class Entry, class Padding>
  void append(std::size_t rows, const Length& length, const Entry& entry, const Padding& padding) {
    for (std::size_t first = 0; first < rows; first += kSlice) {
      const std::size_t last = std::min(first + kSlice, rows);
      std::size_t longest = 0;
      for (std::size_t row = first; row < last; ++row) longest = std::max(longest, length(row));
      for (std::size_t k = 0; k < longest; ++k) {
        for (std::size_t row = first; row < first + kSlice; ++row) {
          if (row >= last) {
            entries.push_back({0, 0});  // no thread reads it
          } else {
            entries.push_back(k < length(row) ? entry(row, k) : padding(row));
          }
        }
      }
      begin.push_back(word(entries.size()));
    }
  }
};

std::string megabytes(std::size_t bytes) {
  return std::to_string((bytes + 999'999) / 1'000'000) + " MB";
}

/// Bytes of four rows of a column.
std::size_t four_rows(bool half) {
  return half ? 4 * sizeof(std::uint16_t) : 4 * sizeof(float);
}

std::size_t places_of(const GpuOrgan& organ) {
  return organ.half != nullptr ? organ.half->rows / 3 : organ.compliance->places;
}

std::size_t touchable_of(const GpuOrgan& organ) {
  if (organ.half == nullptr) return organ.compliance->touchable.size();
  return organ.half->rows > 0 ? organ.half->entries.size() / (3 * organ.half->rows) : 0;
}

Result<void> check_parts(const GpuOrgan& organ) {
  const auto wrong = [&](const std::string& what) -> Result<void> {
    return failure("organ " + organ.name + ": " + what);
  };
  if ((organ.compliance == nullptr && organ.half == nullptr) || organ.drawn == nullptr ||
      organ.drawn->rest == nullptr) {
    return wrong("expected a compliance and a drawn surface, found none");
  }
  const std::size_t places = places_of(organ);
  const std::size_t expected = 9 * places * touchable_of(organ);
  const std::size_t found =
      organ.half != nullptr ? organ.half->entries.size() : organ.compliance->columns.size();
  if (found != expected) {
    return wrong(std::to_string(found) + " entries of its compliance, expected " +
                 std::to_string(expected));
  }
  const DrawnSurface& drawn = *organ.drawn;
  const std::size_t vertices = drawn.rest->vertices.size();
  if (drawn.carriers.rows() != vertices || drawn.triangle_begin.size() != vertices + 1) {
    return wrong("its carriers don't belong to its " + std::to_string(vertices) + " vertices");
  }
  for (const int place : drawn.carriers.nodes) {
    if (place < 0 || static_cast<std::size_t>(place) >= places) {
      return wrong("carried by place " + std::to_string(place) + ", expected less than " +
                   std::to_string(places));
    }
  }
  return {};
}

}  // namespace

/// Everything about the surfaces, before it is uploaded.
struct GpuDeformation::Shape {
  SlicedRows carriers, corners;
  std::vector<Vec3f> rest;                // padded to whole slices, a model after another
  std::vector<Vec3f> positions, normals;  // of the bodies
  std::size_t displacements = 0;          // components
};

Result<GpuDeformation> GpuDeformation::create(std::span<const GpuOrgan> organs, GpuLimits limits) {
  for (const GpuOrgan& organ : organs) {
    if (const Result<void> good = check_parts(organ); !good) return std::unexpected(good.error());
  }
  GpuDeformation made(limits);
  if (const Result<void> loaded = made.load_kernels(); !loaded) {
    return std::unexpected(loaded.error());
  }
  Shape shape;
  made.place_bodies(organs, shape);
  if (const Result<void> uploaded = made.upload(shape); !uploaded) {
    return std::unexpected(uploaded.error());
  }
  return made;
}

Result<void> GpuDeformation::load_kernels() {
  KernelLoader kernels;
  kernels.load(product_, "column_sums.comp", "SINGLE");
  kernels.load(product_half_, "column_sums.comp", "HALF");
  kernels.load(carry_, "deformation.comp", "CARRY");
  kernels.load(near_, "deformation.comp", "NEAR");
  kernels.load(normals_kernel_, "deformation.comp", "NORMALS");
  return kernels.result();
}

/// Adds a model to what will be uploaded, or says which limit forbids it and takes it out again.
std::string GpuDeformation::place_model(Model& model, Shape& shape) {
  const DrawnSurface& drawn = *model.source->drawn;
  const auto refuse = [&](const std::string& what, std::size_t bytes) {
    return what + " would make a storage buffer of " + megabytes(bytes) +
           ", this device binds at most " + megabytes(limits_.block_bytes) + ": stays on the CPU";
  };
  const std::size_t tile_bytes = 3 * model.touchable * kTileLanes * four_rows(model.half);
  if (tile_bytes > limits_.block_bytes) {
    return refuse(std::to_string(kTileRows) + " rows of its compliance", tile_bytes);
  }
  model.first_slice = shape.carriers.slices();
  const std::vector<int>& row_begin = drawn.carriers.row_begin;
  const auto carrier = [&](std::size_t row, std::size_t k, bool weighs) -> Pair {
    const std::size_t at = static_cast<std::size_t>(row_begin[row]) + k;
    return {static_cast<std::uint32_t>(drawn.carriers.nodes[at]),
            weighs ? bits(drawn.carriers.values[at]) : bits(0.0f)};
  };
  const auto carriers_of = [&](std::size_t row) {
    return static_cast<std::size_t>(row_begin[row + 1] - row_begin[row]);
  };
  shape.carriers.append(
      model.vertices, carriers_of,
      [&](std::size_t row, std::size_t k) { return carrier(row, k, true); },
      [&](std::size_t row) { return carriers_of(row) > 0 ? carrier(row, 0, false) : Pair{}; });
  const auto corners = [&](std::size_t vertex, std::size_t k) -> Pair {
    const auto item = static_cast<std::size_t>(drawn.triangle_begin[vertex]) + k;
    const auto& triangle =
        drawn.rest->triangles[static_cast<std::size_t>(drawn.triangle_items[item])];
    std::size_t a = 0;
    while (static_cast<std::size_t>(triangle[a]) != vertex) ++a;
    return {static_cast<std::uint32_t>(triangle[(a + 1) % 3]),
            static_cast<std::uint32_t>(triangle[(a + 2) % 3])};
  };
  shape.corners.append(
      model.vertices,
      [&](std::size_t v) {
        return static_cast<std::size_t>(drawn.triangle_begin[v + 1] - drawn.triangle_begin[v]);
      },
      corners,
      [](std::size_t v) {
        return Pair{word(v), word(v)};
      });
  const std::size_t rows = std::max(shape.carriers.entries.size(), shape.corners.entries.size());
  const std::size_t bytes =
      std::max(sizeof(Pair) * rows, sizeof(Vec3f) * kSlice * shape.carriers.slices());
  if (bytes > limits_.block_bytes) {
    shape.carriers.cut(model.first_slice);
    shape.corners.cut(model.first_slice);
    return refuse("what carries its " + std::to_string(model.vertices) + " vertices", bytes);
  }
  for (const Vec3& vertex : drawn.rest->vertices) shape.rest.push_back(vertex.cast<float>());
  shape.rest.resize(round_up(shape.rest.size(), kSlice), Vec3f::Zero());
  place_columns(model);
  return {};
}

/// Tiles go to the last storage buffer of their precision while there is room, then to a new one.
void GpuDeformation::place_columns(Model& model) {
  const std::size_t stride = 3 * model.touchable * kTileLanes;
  const std::size_t room = limits_.block_bytes / four_rows(model.half);
  const std::size_t tiles = parts_of(3 * model.places, kTileRows);
  std::size_t shard = shards_.size();
  while (shard > 0 && shards_[shard - 1].half != model.half) --shard;
  for (std::size_t tile = 0; tile < tiles;) {
    if (shard == 0 || shards_[shard - 1].size + stride > room) {
      shards_.emplace_back().half = model.half;
      shard = shards_.size();
    }
    Shard& last = shards_[shard - 1];
    const std::size_t fit = stride > 0 ? (room - last.size) / stride : tiles;
    const std::size_t count = std::min(tiles - tile, fit);
    model.runs.push_back({shard - 1, tile, count, last.size});
    last.size += count * stride;
    tile += count;
  }
}

void GpuDeformation::place_bodies(std::span<const GpuOrgan> organs, Shape& shape) {
  std::map<std::pair<const void*, const void*>, std::size_t> model_of;
  std::vector<std::string> refusals;
  for (const GpuOrgan& organ : organs) {
    const void* columns = organ.compliance;
    if (organ.half != nullptr) columns = organ.half;
    const auto [known, is_new] = model_of.try_emplace({columns, organ.drawn}, models_.size());
    if (is_new) {
      Model model;
      model.places = places_of(organ);
      model.touchable = touchable_of(organ);
      model.half = organ.half != nullptr;
      if (model.half) model.scale = organ.half->scale;
      model.vertices = organ.drawn->rest->vertices.size();
      model.source = &organ;
      refusals.push_back(place_model(model, shape));
      models_.push_back(std::move(model));
    }
    const Model& model = models_[known->second];
    Body body;
    body.name = organ.name;
    body.model = known->second;
    body.displacement = shape.displacements;
    body.first_vertex = shape.positions.size();
    const std::size_t components = round_up(3 * model.places, kTileRows);
    const std::size_t bytes = std::max((shape.displacements + components) * sizeof(float),
                                       (shape.positions.size() + model.vertices) * sizeof(Vec3f));
    if (!refusals[known->second].empty()) {
      body.refusal = "organ " + organ.name + ": " + refusals[known->second];
    } else if (bytes > limits_.block_bytes) {
      body.refusal = "organ " + organ.name +
                     ": the displacements of all organs so far would make "
                     "a storage buffer of " +
                     megabytes(bytes) + ", this device binds at most " +
                     megabytes(limits_.block_bytes) + ": stays on the CPU";
    } else {
      shape.displacements += components;
      for (std::size_t v = 0; v < model.vertices; ++v) {
        shape.positions.push_back(organ.drawn->rest->vertices[v].cast<float>());
        shape.normals.push_back(organ.drawn->rest_normals[v].cast<float>());
      }
    }
    bodies_.push_back(std::move(body));
  }
}

Result<void> GpuDeformation::upload(const Shape& shape) {
  while (glGetError() != GL_NO_ERROR) {
  }
  // A buffer without a byte can't be bound.
  const auto room = [&](Buffer& buffer, std::size_t bytes) {
    buffer.allocate(std::max<std::size_t>(bytes, 4 * sizeof(float)));
    bytes_ += buffer.size();
  };
  const auto fill = [&]<class T>(Buffer& buffer, const std::vector<T>& values) {
    room(buffer, values.size() * sizeof(T));
    buffer.upload_part(0, std::span<const T>(values));
  };
  for (Shard& shard : shards_) room(shard.columns, shard.size * four_rows(shard.half));
  fill(slice_begin_carriers_, shape.carriers.begin);
  fill(carriers_, shape.carriers.entries);
  fill(slice_begin_corners_, shape.corners.begin);
  fill(corners_, shape.corners.entries);
  fill(rest_, shape.rest);
  fill(displacements_, std::vector<float>(shape.displacements, 0.0f));
  fill(positions_, shape.positions);
  fill(normals_, shape.normals);
  for (Model& model : models_) {
    if (model.half) {
      upload_columns(model, model.source->half->entries.data());
    } else {
      // The shaders can't ask for columns: all are made now.
      model.source->compliance->need_all();
      upload_columns(model, model.source->compliance->columns.data());
    }
    model.source = nullptr;
  }
  if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
    return failure(
        "organs on the GPU: " + megabytes(bytes_) + " of buffers were refused (" +
        (error == GL_OUT_OF_MEMORY ? "out of memory" : "GL error " + std::to_string(error)) + ")");
  }
  return {};
}

template <class Number>
void GpuDeformation::upload_columns(const Model& model, const Number* values) {
  const std::size_t rows = 3 * model.places, columns = 3 * model.touchable;
  std::vector<Number> tile(columns * kTileRows);
  for (const TileRun& run : model.runs) {
    for (std::size_t t = 0; t < run.tiles; ++t) {
      const std::size_t begin = (run.first_tile + t) * kTileRows;
      const std::size_t count = std::min(kTileRows, rows - begin);
      if (count < kTileRows) std::fill(tile.begin(), tile.end(), Number{});
      for (std::size_t c = 0; c < columns; ++c) {
        std::copy_n(values + c * rows + begin, count, tile.data() + c * kTileRows);
      }
      const std::size_t offset =
          run.offset * four_rows(model.half) + t * tile.size() * sizeof(Number);
      shards_[run.shard].columns.upload_part(offset, std::span<const Number>(tile));
    }
  }
}

Result<void> GpuDeformation::check(std::span<const GpuLoads> organs) const {
  std::set<std::size_t> seen;
  for (const GpuLoads& given : organs) {
    if (given.organ >= bodies_.size()) {
      return failure("organ " + std::to_string(given.organ) + ": expected less than " +
                     std::to_string(bodies_.size()));
    }
    const Body& body = bodies_[given.organ];
    const Model& model = models_[body.model];
    const auto wrong = [&](const std::string& what) {
      return failure("organ " + body.name + ": " + what);
    };
    if (!body.refusal.empty()) return failure(body.refusal);
    if (!seen.insert(given.organ).second) return wrong("deformed twice in a frame");
    if (given.touched.size() != given.loads.size()) {
      return wrong(std::to_string(given.loads.size()) + " loads on " +
                   std::to_string(given.touched.size()) + " places");
    }
    if (given.near_vertices.size() != given.near_field.size()) {
      return wrong(std::to_string(given.near_field.size()) + " near displacements of " +
                   std::to_string(given.near_vertices.size()) + " vertices");
    }
    for (const int t : given.touched) {
      if (t < 0 || static_cast<std::size_t>(t) >= model.touchable) {
        return wrong("load on touchable place " + std::to_string(t) + ", expected less than " +
                     std::to_string(model.touchable));
      }
    }
    int last = -1;
    for (const int v : given.near_vertices) {
      if (v <= last || static_cast<std::size_t>(v) >= model.vertices) {
        return wrong("near field at vertex " + std::to_string(v) +
                     ", expected ascending and less than " + std::to_string(model.vertices));
      }
      last = v;
    }
  }
  return {};
}

/// The frame's organ table (an organ's part for each storage buffer, then for its surface), loads
/// and near fields.
void GpuDeformation::upload_loads(std::span<const GpuLoads> organs) {
  std::vector<std::vector<OrganEntry>> of_shard(shards_.size());
  std::vector<OrganEntry> of_surface;
  std::vector<Quad> loads, near;
  shard_ranges_.assign(shards_.size(), {});
  surface_range_ = {};
  for (const GpuLoads& given : organs) {
    const Body& body = bodies_[given.organ];
    const Model& model = models_[body.model];
    OrganEntry entry;
    entry.tile_stride = word(3 * model.touchable * kTileLanes);
    entry.first_load = word(loads.size());
    entry.loads = word(given.loads.size());
    entry.vertices = word(model.vertices);
    entry.first_slice = word(model.first_slice);
    entry.first_vertex = word(body.first_vertex);
    for (const TileRun& run : model.runs) {
      Range& range = shard_ranges_[run.shard];
      entry.first_group = word(range.groups);
      entry.first_tile = word(run.offset);
      entry.displacement = word(body.displacement + run.first_tile * kTileRows);
      of_shard[run.shard].push_back(entry);
      range.groups += run.tiles;
    }
    entry.first_group = word(surface_range_.groups);
    entry.displacement = word(body.displacement);
    of_surface.push_back(entry);
    surface_range_.groups += parts_of(model.vertices, kSurfaceGroup);
    for (std::size_t j = 0; j < given.loads.size(); ++j) {
      const Vec3f load = (given.loads[j] * model.scale).cast<float>();
      loads.push_back({bits(load.x()), bits(load.y()), bits(load.z()),
                       static_cast<std::uint32_t>(given.touched[j])});
    }
    for (std::size_t j = 0; j < given.near_field.size(); ++j) {
      const Vec3f& moved = given.near_field[j];
      near.push_back({word(body.first_vertex + static_cast<std::size_t>(given.near_vertices[j])),
                      bits(moved.x()), bits(moved.y()), bits(moved.z())});
    }
  }
  std::vector<OrganEntry> table;
  for (std::size_t s = 0; s < of_shard.size(); ++s) {
    shard_ranges_[s].first = table.size();
    shard_ranges_[s].count = of_shard[s].size();
    table.insert(table.end(), of_shard[s].begin(), of_shard[s].end());
  }
  surface_range_.first = table.size();
  surface_range_.count = of_surface.size();
  table.insert(table.end(), of_surface.begin(), of_surface.end());
  near_count_ = near.size();
  loads.resize(std::max<std::size_t>(loads.size(), 1));
  table_.upload(std::span<const OrganEntry>(table));
  loads_.upload(std::span<const Quad>(loads));
  if (near_count_ > 0) near_field_.upload(std::span<const Quad>(near));
}

void GpuDeformation::sum_columns() {
  for (std::size_t s = 0; s < shards_.size(); ++s) {
    Program& product = shards_[s].half ? product_half_ : product_;
    product.set("first_entry", static_cast<int>(shard_ranges_[s].first));
    product.set("entries", static_cast<int>(shard_ranges_[s].count));
    queue_.dispatch(product, shard_ranges_[s].groups,
                    {{0, &table_}, {1, &shards_[s].columns}, {2, &loads_}}, {{3, &displacements_}});
  }
}

void GpuDeformation::move_surfaces(PassTimer* timer) {
  const auto mark = [&](const char* name) {
    if (timer != nullptr) timer->mark(name);
  };
  for (Program* program : {&carry_, &normals_kernel_}) {
    program->set("first_entry", static_cast<int>(surface_range_.first));
    program->set("entries", static_cast<int>(surface_range_.count));
  }
  queue_.dispatch(carry_, surface_range_.groups,
                  {{0, &table_},
                   {1, &slice_begin_carriers_},
                   {2, &carriers_},
                   {3, &displacements_},
                   {4, &rest_}},
                  {{5, &positions_}});
  mark("carry");
  near_.set("entries", static_cast<int>(near_count_));
  queue_.dispatch(near_, parts_of(near_count_, kSurfaceGroup), {{1, &near_field_}},
                  {{2, &positions_}});
  mark("near");
  queue_.dispatch(normals_kernel_, surface_range_.groups,
                  {{0, &table_}, {1, &slice_begin_corners_}, {2, &corners_}, {3, &positions_}},
                  {{4, &normals_}});
  mark("normals");
}

Result<void> GpuDeformation::deform(std::span<const GpuLoads> organs, PassTimer* timer) {
  if (Result<void> good = check(organs); !good) return good;
  if (organs.empty()) return {};
  upload_loads(organs);
  if (timer != nullptr) timer->mark("upload");
  sum_columns();
  if (timer != nullptr) timer->mark("product");
  move_surfaces(timer);
  queue_.make_readable();
  return {};
}

std::vector<float> GpuDeformation::read_displacements(std::size_t organ) const {
  if (!refusal(organ).empty()) return {};
  const Body& body = bodies_[organ];
  return displacements_.download<float>(body.displacement * sizeof(float),
                                        3 * models_[body.model].places);
}

std::vector<Vec3f> GpuDeformation::read_positions(std::size_t organ) const {
  if (!refusal(organ).empty()) return {};
  const Body& body = bodies_[organ];
  return positions_.download<Vec3f>(body.first_vertex * sizeof(Vec3f),
                                    models_[body.model].vertices);
}

std::vector<Vec3f> GpuDeformation::read_normals(std::size_t organ) const {
  if (!refusal(organ).empty()) return {};
  const Body& body = bodies_[organ];
  return normals_.download<Vec3f>(body.first_vertex * sizeof(Vec3f), models_[body.model].vertices);
}

}  // namespace viscera
