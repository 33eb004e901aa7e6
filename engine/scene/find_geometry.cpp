#include "engine/scene/find_geometry.h"

#include <algorithm>

#include "engine/scene/geometry_formats.h"
#include "engine/scene/spelling.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> entries(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code failed;
  for (auto entry = fs::directory_iterator(folder, failed); !failed && entry != fs::end(entry);
       entry.increment(failed))
    found.push_back(entry->path());
  std::sort(found.begin(), found.end());
  return found;
}

/// Files of one kind, by how their names end.
struct FileKind {
  bool (*is)(const fs::path& file);
  std::vector<std::string> endings;
  const char* name;  ///< "a surface"
};

std::vector<std::string> file_names(const std::vector<fs::path>& folders, const FileKind& kind) {
  std::vector<std::string> names;
  for (const fs::path& folder : folders) {
    for (const fs::path& entry : entries(folder))
      if (kind.is(entry)) names.push_back(entry.filename().string());
  }
  return names;
}

std::string listed(const std::vector<fs::path>& folders) {
  std::vector<std::string> words;
  std::error_code ignored;
  for (const fs::path& folder : folders)
    words.push_back(folder.string() +
                    (fs::is_directory(folder, ignored) ? "" : " (no such folder)"));
  return joined(words);
}

/// Links followed: a scene of somebody else's reads nothing that its user didn't lay there.
bool lies_in_a_root(const fs::path& file, const GeometrySearch& search) {
  std::vector<fs::path> roots = search.extra;
  roots.push_back(search.scene_folder.empty() ? fs::path(".") : search.scene_folder);
  roots.push_back(search.assets);
  std::error_code failed;
  const fs::path target = fs::canonical(file, failed);
  if (failed) return false;
  return std::ranges::any_of(roots, [&](const fs::path& folder) {
    const fs::path root = fs::canonical(folder, failed);
    return !failed && std::ranges::mismatch(root, target).in1 == root.end();
  });
}

}  // namespace

std::vector<fs::path> search_folders(const GeometrySearch& search) {
  std::vector<fs::path> folders = {search.scene_folder.empty() ? fs::path(".")
                                                               : search.scene_folder};
  std::error_code ignored;
  for (const fs::path& folder : search.extra) {
    folders.push_back(folder);
    for (const fs::path& entry : entries(folder))
      if (fs::is_directory(entry, ignored)) folders.push_back(entry);
  }
  folders.push_back(search.assets);
  return folders;
}

namespace {

Result<fs::path> find_file(const std::string& file, const GeometrySearch& search,
                           const FileKind& kind) {
  if (file.find('\0') != std::string::npos)
    return failure(std::string("found a NUL in a file's name, expected the name of ") + kind.name +
                   "'s file");
  if (!kind.is(file))
    return failure("found the file \"" + file + "\", expected one that ends in " +
                   joined(kind.endings));
  std::vector<fs::path> folders;
  if (!fs::path(file).is_absolute())
    folders = search_folders(search);
  else
    folders.push_back(fs::path(file).parent_path());

  std::error_code ignored;
  for (const fs::path& folder : folders) {
    const fs::path candidate = (folder / file).lexically_normal();
    if (fs::is_regular_file(candidate, ignored)) {
      if (lies_in_a_root(candidate, search)) return candidate;
      return failure("found " + candidate.string() +
                     ", which leads out of the scene's folder and those of assets, expected a file "
                     "in one of them (--assets FOLDER adds one)");
    }
    if (fs::exists(candidate, ignored))
      return failure("found " + candidate.string() + ", which is no regular file, expected one");
  }
  return failure("found no file \"" + file + "\", expected it in one of " + listed(folders) +
                 did_you_mean(fs::path(file).filename().string(), file_names(folders, kind)));
}

}  // namespace

Result<fs::path> find_geometry(const std::string& file, const GeometrySearch& search) {
  static const FileKind kSurface = {
      is_geometry_file, {kGeometryExtensions.begin(), kGeometryExtensions.end()}, "a surface"};
  return find_file(file, search, kSurface);
}

Result<fs::path> find_volume(const std::string& file, const GeometrySearch& search) {
  static const FileKind kVolume = {
      is_volume_file, {kVolumeEndings.begin(), kVolumeEndings.end()}, "a label map"};
  return find_file(file, search, kVolume);
}

}  // namespace viscera
