// Where tests find and put files.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace viscera::test {

/// A file or folder of the project, by its path from the top ("assets/tissues.json").
std::filesystem::path project_file(const std::string& path);

/// A file of the optional data folder beside the checkout (../shared/data, or VISCERA_DATA);
/// nothing where it is absent: the test then says skipped.
std::optional<std::filesystem::path> shared_data(const std::string& path);

/// A whole file as it stands; empty where it can't be read.
std::string file_text(const std::filesystem::path& file);

/// A fresh empty folder for one test, without links in its name, removed with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace viscera::test
