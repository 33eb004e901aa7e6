// viscera_reader: reads one file of somebody else's, confined, and writes what it says to its
// output (engine/io/reader_process.h). Started by viscera, never by a person.
#include <unistd.h>

#include <charconv>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <span>
#include <string>
#include <system_error>

#include "engine/io/confine.h"
#include "engine/io/foreign_files.h"
#include "engine/io/label_map.h"
#include "engine/io/mesh_import.h"
#include "engine/io/reader_process.h"
#include "engine/io/vdb_volume.h"

namespace viscera {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;
using Words = std::span<char*>;

template <class T>
Result<Bytes> bytes_of(const Result<T>& value) {
  if (!value) return std::unexpected(value.error());
  return saved(*value);
}

Result<Bytes> read_surface(const fs::path& file, Words words) {
  return bytes_of(import_surface_here(file, std::strtod(words[0], nullptr)));
}

Result<Bytes> read_labels(const fs::path& file, Words) {
  return bytes_of(read_label_volume_here(file));
}

Result<Bytes> read_smoke(const fs::path& file, Words) {
  return bytes_of(read_smoke_info_here(file));
}

Result<Bytes> read_sealed(const fs::path& file, Words words) {
  auto data = read_cache_file(file, std::atoi(words[0]), words[1]);
  if (!data) return std::unexpected(data.error());
  SealedContents contents;
  contents.texts = std::move(data->texts());
  for (auto& [name, values] : data->arrays()) {
    if (auto* doubles = std::get_if<std::vector<double>>(&values))
      contents.doubles[name] = std::move(*doubles);
    else if (auto* floats = std::get_if<std::vector<float>>(&values))
      contents.floats[name] = std::move(*floats);
    else
      contents.integers[name] = std::move(std::get<std::vector<int>>(values));
  }
  return saved(contents);
}

struct Reader {
  std::string_view name;
  std::size_t words;
  Result<Bytes> (*read)(const fs::path& file, Words words);
};

constexpr Reader kReaders[] = {{kSurfaceReader, 1, read_surface},
                               {kLabelReader, 0, read_labels},
                               {kSmokeReader, 0, read_smoke},
                               {kSealedReader, 2, read_sealed}};

/// reader, memory [bytes], seconds, file, words of the reader's own.
constexpr int kFixedWords = 5;

int run(int argc, char** argv) {
  for (const Reader& reader : kReaders) {
    if (argc != kFixedWords + static_cast<int>(reader.words) || argv[1] != reader.name) continue;
    std::error_code failed;
    const fs::path file = argv[4], target = fs::canonical(file, failed);
    const std::string name = file.string();
    if (!failed)
      confine(std::strtoull(argv[2], nullptr, 10), std::strtod(argv[3], nullptr),
              target.parent_path());
    try {
      give_answer(STDOUT_FILENO,
                  reader.read(file, {argv + kFixedWords, static_cast<std::size_t>(reader.words)}));
    } catch (const std::bad_alloc&) {
      give_answer(
          STDOUT_FILENO,
          failure(name + ": cannot be read: that takes more memory than a sound file of its "
                         "size"));
    } catch (const std::exception& error) {
      give_answer(STDOUT_FILENO, failure(name + ": cannot be read: " + error.what()));
    }
    // Whatever a damaged file has left behind isn't taken down.
    std::_Exit(0);
  }
  return 2;
}

}  // namespace
}  // namespace viscera

int main(int argc, char** argv) {
  return viscera::run(argc, argv);
}
