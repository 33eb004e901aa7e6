#include "engine/io/cache_file.h"

#include <fcntl.h>
#include <hdf5.h>
#include <unistd.h>

#include <cerrno>
#include <mutex>
#include <string_view>
#include <system_error>
#include <utility>

#include "engine/io/atomic_file.h"
#include "kernels/base/hash.h"

namespace viscera {
namespace fs = std::filesystem;

namespace {

constexpr hsize_t kPage = 4096;
constexpr const char* kArrays = "arrays";  // group of the datasets
constexpr const char* kTexts = "texts";    // group whose attributes are the texts
// The user block, which HDF5 leaves to us: this line, then the checksum of everything after the
// block.
constexpr std::string_view kSignature = "Viscera cache, XXH3-128 ";
constexpr std::size_t kChecksumDigits = 32;
constexpr std::size_t kLongestText = 60'000;  // an attribute's object header message holds 64 KB

/// The distribution's library isn't thread-safe.
std::mutex& library() {
  static std::mutex mutex;
  // Its own messages would go to stderr; ours say what matters.
  static const herr_t quiet = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  static_cast<void>(quiet);
  return mutex;
}

/// An HDF5 identifier that closes itself.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }
  bool ok() const { return id_ >= 0; }
  /// False when what was still buffered couldn't be written.
  bool close() { return close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

template <class T>
hid_t native_type() {
  if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<T, float>) return H5T_NATIVE_FLOAT;
  if constexpr (std::is_same_v<T, int>) return H5T_NATIVE_INT32;
}

bool write_text(hid_t object, const std::string& name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  // A string type of size zero doesn't exist; the terminator is stored with it.
  if (H5Tset_size(type, value.size() + 1) < 0) return false;
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  return attribute.ok() && H5Awrite(attribute, type, value.c_str()) >= 0;
}

bool read_text(hid_t object, const char* name, std::string& value) {
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.ok()) return false;
  const Handle type(H5Aget_type(attribute), H5Tclose);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0) return false;
  const std::size_t size = H5Tget_size(type);
  if (size == 0 || size > kLongestText + 1) return false;
  value.assign(size, '\0');
  if (H5Aread(attribute, type, value.data()) < 0) return false;
  value.pop_back();
  return true;
}

template <class T>
bool write_array(hid_t group, const std::string& name, std::span<const T> values) {
  const hsize_t size = values.size();
  const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  const Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_layout(layout, H5D_CONTIGUOUS);
  H5Pset_fill_time(layout, H5D_FILL_TIME_NEVER);
  H5Pset_alloc_time(layout, H5D_ALLOC_TIME_EARLY);
  Handle dataset(
      H5Dcreate2(group, name.c_str(), native_type<T>(), space, H5P_DEFAULT, layout, H5P_DEFAULT),
      H5Dclose);
  if (!dataset.ok()) return false;
  if (size > 0 &&
      H5Dwrite(dataset, native_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    return false;
  }
  return dataset.close();
}

template <class T>
bool read_values(hid_t dataset, hsize_t size, std::uintmax_t file_size, CacheData::Array& array) {
  // A broken size must not ask for all the memory there is.
  if (size > file_size / sizeof(T)) return false;
  std::vector<T> values(size);
  if (size > 0 &&
      H5Dread(dataset, native_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
    return false;
  }
  array = std::move(values);
  return true;
}

bool read_array(hid_t group, const std::string& name, std::uintmax_t file_size,
                CacheData::Array& array) {
  const Handle dataset(H5Dopen2(group, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!dataset.ok()) return false;
  const Handle space(H5Dget_space(dataset), H5Sclose);
  hsize_t size = 0;
  if (H5Sget_simple_extent_ndims(space) != 1) return false;
  if (H5Sget_simple_extent_dims(space, &size, nullptr) != 1) return false;
  const Handle type(H5Dget_type(dataset), H5Tclose);
  if (H5Tequal(type, H5T_NATIVE_DOUBLE) > 0) {
    return read_values<double>(dataset, size, file_size, array);
  }
  if (H5Tequal(type, H5T_NATIVE_FLOAT) > 0) {
    return read_values<float>(dataset, size, file_size, array);
  }
  if (H5Tequal(type, H5T_NATIVE_INT32) > 0) {
    return read_values<int>(dataset, size, file_size, array);
  }
  return false;
}

/// Names in the order of the names.
std::vector<std::string> array_names(hid_t group) {
  std::vector<std::string> names;
  H5Literate(
      group, H5_INDEX_NAME, H5_ITER_INC, nullptr,
      [](hid_t, const char* name, const H5L_info_t*, void* out) -> herr_t {
        static_cast<std::vector<std::string>*>(out)->emplace_back(name);
        return 0;
      },
      &names);
  return names;
}

std::vector<std::string> text_names(hid_t group) {
  std::vector<std::string> names;
  H5Aiterate2(
      group, H5_INDEX_NAME, H5_ITER_INC, nullptr,
      [](hid_t, const char* name, const H5A_info_t*, void* out) -> herr_t {
        static_cast<std::vector<std::string>*>(out)->emplace_back(name);
        return 0;
      },
      &names);
  return names;
}

/// Asks the file system for the room before HDF5 starts, which leaves open objects behind when a
/// write fails. errno, or 0.
int reserve_room(const fs::path& file, std::size_t bytes) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) return errno;
  int error = ::posix_fallocate(descriptor, 0, static_cast<off_t>(bytes));
  if (error == EOPNOTSUPP || error == EINVAL) error = 0;  // devices and some file systems
  ::close(descriptor);
  return error;
}

bool write_hdf5(const fs::path& file, int format, const std::string& key,
                const CacheContents& contents) {
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  H5Pset_userblock(creation, kPage);
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_alignment(access, kPage, kPage);
  Handle out(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, creation, access), H5Fclose);
  if (!out.ok()) return false;

  bool good = write_text(out, "format", std::to_string(format)) && write_text(out, "key", key);
  {
    const Handle texts(H5Gcreate2(out, kTexts, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    for (const auto& [name, value] : contents.texts()) {
      good = good && write_text(texts, name, value);
    }
    const Handle arrays(H5Gcreate2(out, kArrays, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
    for (const auto& [name, view] : contents.arrays()) {
      good = good &&
             std::visit([&, name = name](auto values) { return write_array(arrays, name, values); },
                        view);
    }
  }
  return out.close() && good;
}

/// The hash of a file's bytes from the end of the user block on. Nothing where it can't be read.
std::string hash_after_block(int descriptor) {
  Hasher hasher;
  std::vector<char> part(1 << 20);
  off_t at = kPage;
  while (true) {
    const ssize_t got = ::pread(descriptor, part.data(), part.size(), at);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return "";
    if (got == 0) return hasher.hex();
    hasher.bytes(part.data(), static_cast<std::size_t>(got));
    at += got;
  }
}

/// errno, or 0.
int seal(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0) return errno;
  errno = 0;
  const std::string block = std::string(kSignature) + hash_after_block(descriptor);
  const ssize_t written = ::pwrite(descriptor, block.data(), block.size(), 0);
  const int error = errno != 0 ? errno : written == static_cast<ssize_t>(block.size()) ? 0 : EIO;
  ::close(descriptor);
  return error;
}

/// HDF5 trusts its own bookkeeping and may crash on a damaged file, so it sees only whole ones.
Result<void> check_seal(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    return failure("it can't be read: " + std::generic_category().message(errno));
  }
  std::string block(kSignature.size() + kChecksumDigits, '\0');
  const bool read =
      ::pread(descriptor, block.data(), block.size(), 0) == static_cast<ssize_t>(block.size());
  const std::string checksum = read ? hash_after_block(descriptor) : "";
  ::close(descriptor);
  if (!read || !block.starts_with(kSignature)) {
    return failure("it wasn't written by Viscera, or not to its end");
  }
  if (block.substr(kSignature.size()) != checksum) return failure("it is truncated or damaged");
  return {};
}

}  // namespace

Result<std::string> CacheData::text(const std::string& name) const {
  const auto found = texts_.find(name);
  if (found == texts_.end()) return failure("the text " + name + " is missing");
  return found->second;
}

Result<void> write_cache_file(const fs::path& file, int format, const std::string& key,
                              const CacheContents& contents) {
  std::size_t bytes = 1 << 16;  // HDF5's own
  for (const auto& [name, value] : contents.texts()) {
    if (value.size() > kLongestText) {
      return failure(file.string() + ": the text " + name + " is longer than " +
                     std::to_string(kLongestText) + " bytes");
    }
    bytes += value.size();
  }
  for (const auto& [name, view] : contents.arrays()) {
    bytes += std::visit([](auto values) { return values.size_bytes() + kPage; }, view);
  }

  const std::scoped_lock lock(library());
  PendingFile pending(file);
  if (pending.in_place()) {
    return failure(file.string() + ": expected a place for a file, found a device or a pipe");
  }
  if (const int error = reserve_room(pending.temporary(), bytes); error != 0) {
    return std::unexpected(write_error(file, error));
  }
  errno = 0;
  if (!write_hdf5(pending.temporary(), format, key, contents)) {
    return std::unexpected(write_error(file, errno != 0 ? errno : EIO));
  }
  if (const int error = seal(pending.temporary()); error != 0) {
    return std::unexpected(write_error(file, error));
  }
  return pending.commit();
}

Result<CacheData> read_cache_file(const fs::path& file, int format, const std::string& key) {
  if (auto whole = check_seal(file); !whole) return std::unexpected(whole.error());
  std::error_code error;
  const std::uintmax_t file_size = fs::file_size(file, error);
  if (error) return failure("it can't be read: " + error.message());

  const std::scoped_lock lock(library());
  const Handle in(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  std::string found_format, found_key;
  if (!in.ok() || !read_text(in, "format", found_format) || !read_text(in, "key", found_key)) {
    return failure("HDF5 can't read it");
  }
  if (found_format != std::to_string(format)) {
    return failure("its format is " + found_format + ", expected " + std::to_string(format));
  }
  if (found_key != key) return failure("it was made for other inputs (key " + found_key + ")");

  const Handle texts(H5Gopen2(in, kTexts, H5P_DEFAULT), H5Gclose);
  const Handle arrays(H5Gopen2(in, kArrays, H5P_DEFAULT), H5Gclose);
  if (!texts.ok() || !arrays.ok()) return failure("HDF5 can't read its groups");
  CacheData data;
  for (const std::string& name : text_names(texts)) {
    if (!read_text(texts, name.c_str(), data.texts()[name])) {
      return failure("HDF5 can't read its text " + name);
    }
  }
  for (const std::string& name : array_names(arrays)) {
    if (!read_array(arrays, name, file_size, data.arrays()[name])) {
      return failure("HDF5 can't read its array " + name);
    }
  }
  return data;
}

}  // namespace viscera
