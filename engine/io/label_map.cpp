#include "engine/io/label_map.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <set>

#include "engine/io/foreign_files.h"
#include "engine/io/nifti_file.h"
#include "engine/io/nrrd_file.h"

namespace viscera {
namespace {

constexpr double kLeastExtent = 5e-3, kGreatestExtent = 3.0;  // of a volume [m]
// A label map may be made of slices: half a millimetre wide, some millimetres thick.
constexpr double kLongestVoxel = 100.0;
constexpr double kSkew = 1e-3;  // cosine between axes that are still at right angles

std::string lower_name(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

bool is_nifti(const std::filesystem::path& file) {
  const std::string name = lower_name(file);
  return name.ends_with(".nii") || name.ends_with(".nii.gz");
}

bool is_nrrd(const std::filesystem::path& file) {
  const std::string name = lower_name(file);
  return name.ends_with(".nrrd") || name.ends_with(".nhdr");
}

std::string digits(double value, const char* unit) {
  char text[48];
  std::snprintf(text, sizeof text, "%.4g %s", value, unit);
  return text;
}

struct Unit {
  const char* name;
  const char* words;
  double metres;
};
constexpr std::array<Unit, 4> kUnits = {{{"mm", "millimetres", 1e-3},
                                         {"cm", "centimetres", 1e-2},
                                         {"m", "metres", 1.0},
                                         {"um", "micrometres", 1e-6}}};

// The unit under which the volume is of a body's size, as a question; "" where none is.
std::string guess(const LabelVolume& volume) {
  const double longest =
      volume.axes.colwise().norm().cwiseProduct(volume.size.cast<double>().transpose()).maxCoeff();
  for (const Unit& unit : kUnits) {
    const double metres = longest * unit.metres;
    if (metres < 0.02 || metres > 2.5) continue;
    return std::string(unit.words) + "? --unit " + unit.name;
  }
  return "";
}

Result<void> check_axes(const LabelVolume& volume) {
  if (!volume.axes.allFinite() || !volume.origin.allFinite()) {
    return failure("found an orientation that isn't finite numbers");
  }
  const Vec3 steps = volume.axes.colwise().norm();
  if (!(steps.minCoeff() > 0.0)) {
    return failure("found an orientation with an axis of no length, expected three");
  }
  if (steps.maxCoeff() > kLongestVoxel * steps.minCoeff()) {
    return failure("found voxels " + digits(steps.maxCoeff() / steps.minCoeff(), "times") +
                   " as long as wide, expected at most " + digits(kLongestVoxel, "times"));
  }
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3;
    const double cosine = volume.axes.col(a).dot(volume.axes.col(b)) / (steps[a] * steps[b]);
    if (std::abs(cosine) < kSkew) continue;
    return failure("found axes at " + digits(std::acos(cosine) * 180.0 / 3.14159265358979, "deg") +
                   ", expected right angles (a tilted gantry?): resample it first");
  }
  return {};
}

Result<void> check_extent(const LabelVolume& volume, double unit) {
  const Vec3 extents =
      unit * volume.axes.colwise().norm().transpose().cwiseProduct(volume.size.cast<double>());
  const double longest = extents.maxCoeff();
  if (longest >= kLeastExtent && longest <= kGreatestExtent) return {};
  std::string message =
      "found a volume of " + digits(longest, "m") + " across, expected 5 mm to 3 m";
  if (const std::string words = guess(volume); !words.empty()) message += " (" + words + ")";
  return failure(message);
}

}  // namespace

std::string LabelMap::orientation() const {
  constexpr std::array<const char*, 3> kLetters = {"LR", "SI", "AP"};
  std::string found;
  for (int axis = 0; axis < 3; ++axis) {
    int along = 0;
    axes.col(axis).cwiseAbs().maxCoeff(&along);
    found += kLetters[along][axes(along, axis) > 0.0 ? 0 : 1];
  }
  return found;
}

Result<LabelVolume> read_label_volume_here(const std::filesystem::path& file) {
  return is_nifti(file) ? read_nifti(file) : read_nrrd(file);
}

bool is_label_map_file(const std::filesystem::path& file) {
  return is_nifti(file) || is_nrrd(file);
}

Result<LabelMap> read_label_map(const std::filesystem::path& file, const LabelMapOptions& options) {
  if (!is_label_map_file(file)) {
    return failure(file.string() +
                   ": found another format, expected .nii, .nii.gz, .nrrd or .nhdr");
  }
  auto volume = read_label_volume(file);
  if (!volume) return std::unexpected(volume.error());
  return label_map_of(file, *std::move(volume), options);
}

Result<LabelMap> label_map_of(const std::filesystem::path& file, LabelVolume volume,
                              const LabelMapOptions& options) {
  const std::string name = file.string() + ": ";
  LabelMap map;
  map.file = file;
  map.format = is_nifti(file) ? "NIfTI-1" : "NRRD";
  if (const auto sound = check_axes(volume); !sound) {
    return failure(name + sound.error().text());
  }
  if (!options.unit && !volume.unit && !options.assumed) {
    const std::string words = guess(volume);
    return failure(name + "found no unit of length in the file, expected it from --unit" +
                   (words.empty() ? "" : " (" + words + ")"));
  }
  map.unit = options.unit ? *options.unit : volume.unit ? *volume.unit : *options.assumed;
  map.unit_assumed = !options.unit && !volume.unit;
  if (options.unit && volume.unit && *options.unit != *volume.unit) {
    map.unit_overridden = *volume.unit;
  }
  if (const auto fits = check_extent(volume, map.unit); !fits) {
    return failure(name + fits.error().text());
  }
  map.size = volume.size;
  map.axes = map.unit * volume.axes;
  map.origin = map.unit * volume.origin;
  map.names = std::move(volume.names);
  map.labels = std::move(volume.labels);

  std::set<std::int32_t> found;
  std::int32_t previous = 0;
  for (const std::int32_t label : map.labels) {
    if (label == previous) continue;
    found.insert(previous = label);
    if (found.size() <= options.most_values) continue;
    return failure(name + "found more than " + std::to_string(options.most_values) +
                   " different values, expected labels: is this an image?");
  }
  if (std::ranges::none_of(map.labels, [](std::int32_t label) { return label != 0; })) {
    return failure(name + "found no label but 0, the background");
  }
  return map;
}

std::map<std::int32_t, LabelExtent> label_extents(const LabelMap& map) {
  std::map<std::int32_t, LabelExtent> extents;
  std::size_t at = 0;
  for (int k = 0; k < map.size.z(); ++k) {
    for (int j = 0; j < map.size.y(); ++j) {
      for (int i = 0; i < map.size.x(); ++i, ++at) {
        if (map.labels[at] == 0) continue;
        const Eigen::Vector3i here(i, j, k);
        LabelExtent& extent = extents[map.labels[at]];
        if (extent.voxels++ == 0) extent.first = extent.last = here;
        extent.first = extent.first.cwiseMin(here);
        extent.last = extent.last.cwiseMax(here);
      }
    }
  }
  return extents;
}

Box box_of(const LabelMap& map, const LabelExtent& extent) {
  Box box;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 index;
    for (int axis = 0; axis < 3; ++axis) {
      index[axis] = corner >> axis & 1 ? extent.last[axis] + 0.5 : extent.first[axis] - 0.5;
    }
    box.extend(map.centre(index));
  }
  return box;
}

}  // namespace viscera
