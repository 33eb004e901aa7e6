// What stands in a whole container of arrays and texts: recordings, shapes, responses and factors
// of organs. The first byte says which, the rest is the container as viscera_reader hands it over.
#include <numeric>

#include "engine/features/held_tools/haptic_recording.h"
#include "engine/io/factor_file.h"
#include "engine/io/foreign_files.h"
#include "engine/io/response_cache.h"
#include "engine/organ/shape_file.h"
#include "kernels/base/archive.h"
#include "tests/fuzz/recordings.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace viscera::fuzz {
namespace {

enum Kind : char { kRecording, kShape, kResponse, kFactor };

CacheData data_of(SealedContents contents) {
  CacheData data;
  data.texts() = std::move(contents.texts);
  for (auto& [name, values] : contents.doubles) data.arrays()[name] = std::move(values);
  for (auto& [name, values] : contents.floats) data.arrays()[name] = std::move(values);
  for (auto& [name, values] : contents.integers) data.arrays()[name] = std::move(values);
  return data;
}

bool is_shape(CacheData data) {
  PreparedShape shape;
  if (!shape_of(std::move(data), shape)) return false;
  const auto vertices = static_cast<int>(shape.surface.vertices.size());
  for (const Vec3& vertex : shape.surface.vertices)
    expect(vertex.allFinite(), "a vertex is finite numbers");
  for (const auto& triangle : shape.surface.triangles)
    for (const int corner : triangle)
      expect(corner >= 0 && corner < vertices, "a triangle's corners are there");
  return true;
}

bool is_response(CacheData data) {
  const auto response = response_of(std::move(data));
  if (!response) return false;
  const SurfaceCompliance& compliance = response->compliance;
  expect(response->cloud.spacings.size() == response->cloud.positions.size(), "a spacing a node");
  for (const Vec3& position : response->cloud.positions)
    expect(position.allFinite(), "a node is somewhere");
  expect(response->cloud.surface_count <= response->cloud.positions.size(), "nodes of a surface");
  for (const int place : compliance.touchable)
    expect(place >= 0 && static_cast<std::size_t>(place) < compliance.places, "a place is there");
  expect(compliance.columns.size() == 9 * compliance.places * compliance.touchable.size(),
         "columns are whole");
  return true;
}

bool is_factor(CacheData data) {
  const auto factor = factor_of(std::move(data));
  if (!factor) return false;
  const PackedFactor packed = factor->pack();
  expect(!packed.order.empty() && packed.fronts.size() % PackedFactor::kNumbersAFront == 0,
         "a factor has fronts");
  return true;
}

bool read(std::string_view input) {
  if (input.empty()) return false;
  SealedContents contents;
  ByteReader reader(std::as_bytes(std::span(input.substr(1))));
  viscera::read(reader, contents);
  if (reader.failed() || !reader.at_end()) return false;
  CacheData data = data_of(std::move(contents));
  switch (input.front() % 4) {
    case kRecording:
      return is_recording(recording_of(std::move(data)));
    case kShape:
      return is_shape(std::move(data));
    case kResponse:
      return is_response(std::move(data));
    default:
      return is_factor(std::move(data));
  }
}

std::string seed(Kind kind, const SealedContents& contents) {
  const std::vector<std::byte> bytes = saved(contents);
  return static_cast<char>(kind) +
         std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::vector<std::string> seeds() {
  SealedContents recording;
  recording.texts = {{"device", "simulated"}};
  recording.doubles = {{"header", {1e-3, -1, -1, -1, 1, 1, 1, 8, 3, 1e-5, 0.1, 0, 1e3, 0.05}},
                       {"rows", {0,    0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0,  //
                                 1e-3, 0, 0, 0, 1, 0, 0, 0, 0, 2, 1, 0, 0, 1}}};
  SealedContents shape;
  shape.texts = {{"notes", "closed\n"}};
  shape.doubles = {{"vertices", {0, 0, 0, 1, 0, 0, 0, 1, 0}}};
  shape.integers = {{"triangles", {0, 1, 2}}};
  SealedContents response;
  response.doubles = {{"positions", {0, 0, 0, 1, 0, 0}},
                      {"spacings", {1, 1}},
                      {"figures", std::vector<double>(10, 1.0)},
                      {"extra.more", {1}}};
  response.integers = {
      {"surface_count", {1}}, {"places", {2}}, {"touchable", {1}}, {"symmetric", {1}}};
  response.floats = {{"columns", std::vector<float>(18, 1.0f)}};
  // Two nodes: a front of the first, whose border is the second, and the second's.
  SealedContents factor;
  factor.integers = {{"order", {1, 0}}, {"fronts", {0, 1, 1, 1, 1, 2, -1, 0}}, {"borders", {1}}};
  factor.floats = {{"single_panels", {}}};
  factor.doubles = {{"full_panels", std::vector<double>(27, 1.0)}};
  return {seed(kRecording, recording), seed(kShape, shape), seed(kResponse, response),
          seed(kFactor, factor)};
}

}  // namespace

Target cache() {
  return {read, seeds};
}

}  // namespace viscera::fuzz
