// Label maps of bodies that tests know, written as NIfTI-1 and NRRD.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "kernels/base/types.h"

namespace viscera::test {

/// A map in the file's own terms: `axes` and `origin` lead from voxel to right, anterior, superior
/// in `unit`s of the file.
struct LabelImage {
  Eigen::Vector3i size = {20, 20, 20};
  Mat3 axes = Mat3::Identity();
  Vec3 origin = Vec3::Zero();
  std::vector<std::int32_t> labels;  ///< (size), i fastest

  void resize() { labels.assign(static_cast<std::size_t>(size.prod()), 0); }
  Vec3 centre(int i, int j, int k) const { return origin + axes * Vec3(i, j, k); }
  std::int32_t& at(int i, int j, int k) {
    return labels[(static_cast<std::size_t>(k) * size.y() + j) * size.x() + i];
  }
  /// Gives `label` to the voxels whose centres are in.
  void fill(std::int32_t label, const std::function<bool(const Vec3&)>& inside);
};

/// An image of these voxel edges whose middle is at the origin.
LabelImage centred_image(const Eigen::Vector3i& size, const Vec3& spacing);

/// Voxel values as bytes of another type; datatype codes of NIfTI-1.
enum class NiftiType { kUint8 = 2, kInt16 = 4, kInt32 = 8, kFloat = 16, kDouble = 64 };

struct NiftiOptions {
  NiftiType type = NiftiType::kInt16;
  int datatype_code = 0;  ///< written in place of the type's own; 0: its own
  int units = 2;          ///< xyzt_units: 1 m, 2 mm, 3 um, 0 unknown
  bool sform = true, qform = false;
  bool swap = false;  ///< the other byte order
  double slope = 0.0, intercept = 0.0;
  std::vector<int> more_dimensions;  ///< after the third
  std::string extension;             ///< text between header and voxels
  std::string magic = "n+1";
  double add = 0.0;  ///< to every value, before scaling is undone
};

/// The bytes of a .nii file.
std::string nifti_bytes(const LabelImage& image, const NiftiOptions& options = {});

/// Voxels as little-endian 16-bit numbers.
std::string voxel_bytes(const LabelImage& image);

/// An NRRD header with `space` (RAS, LPS, LAS) and `more` lines, up to the empty line.
std::string nrrd_header(const LabelImage& image, const std::string& space,
                        const std::string& encoding = "raw",
                        const std::string& more = "space units: \"mm\" \"mm\" \"mm\"\n");

std::string gzipped(const std::string& bytes);
void write_bytes(const std::filesystem::path& file, const std::string& bytes);

}  // namespace viscera::test
