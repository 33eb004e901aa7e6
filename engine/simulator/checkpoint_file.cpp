#include "engine/simulator/checkpoint_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <span>

#include "engine/io/atomic_file.h"
#include "engine/io/report.h"
#include "kernels/base/archive.h"
#include "kernels/base/hash.h"
#include "kernels/base/input_file.h"

namespace viscera {
namespace fs = std::filesystem;
namespace {

constexpr std::array<char, 8> kMagic = {'v', 'i', 's', 'c', 'h', 'e', 'c', 'k'};
constexpr std::uint32_t kFormat = 1;
constexpr std::uintmax_t kMostBytes = std::uintmax_t{16} << 30;

/// The file's first bytes; after them comes the body, by archive.h.
struct Head {
  std::array<char, 8> magic = kMagic;
  std::uint32_t format = kFormat;
  std::uint32_t unused = 0;
  std::uint64_t body = 0;              ///< bytes
  std::array<char, 32> checksum = {};  ///< of all that goes before and of the body
  static constexpr auto fields() {
    return std::tuple(field("magic", &Head::magic), field("format", &Head::format),
                      field("unused", &Head::unused), field("body", &Head::body),
                      field("checksum", &Head::checksum));
  }
};
static_assert(is_flat<Head>());

std::array<char, 32> checksum_of(const Head& head, std::span<const std::byte> body) {
  Hasher hasher;
  hasher.bytes(head.magic.data(), head.magic.size());
  hasher.value(head.format).value(head.unused).value(head.body);
  hasher.bytes(body.data(), body.size());
  const std::string hex = hasher.hex();
  std::array<char, 32> checksum = {};
  std::copy_n(hex.begin(), std::min(hex.size(), checksum.size()), checksum.begin());
  return checksum;
}

template <class Sink>
void write_body(Sink& sink, const Checkpoint& checkpoint) {
  write(sink, checkpoint.identity);
  write(sink, static_cast<std::uint64_t>(checkpoint.parts.size()));
  for (const CheckpointPart& part : checkpoint.parts) {
    write(sink, part.name);
    write(sink, part.bytes);
  }
}

bool read_body(std::span<const std::byte> body, Checkpoint& checkpoint) {
  ByteReader reader(body);
  read(reader, checkpoint.identity);
  checkpoint.parts.resize(reader.count(2 * sizeof(std::uint64_t)));
  for (CheckpointPart& part : checkpoint.parts) {
    read(reader, part.name);
    read(reader, part.bytes);
  }
  return !reader.failed() && reader.at_end();
}

Result<void> check_identity(const fs::path& file, const CheckpointIdentity& found,
                            const CheckpointIdentity& expected) {
  Error error;
  const auto compare = [&](const char* what, const std::string& is, const std::string& wanted) {
    if (is != wanted)
      error.messages.push_back(fmt::format("{}: found a checkpoint of {} {}, expected {}",
                                           file.string(), what, is, wanted));
  };
  compare("version", found.program, expected.program);
  compare("the scene with hash", found.scene, expected.scene);
  compare("the machine", found.machine, expected.machine);
  compare("the layout with hash", found.layout, expected.layout);
  if (!error.messages.empty()) return std::unexpected(error);
  return {};
}

}  // namespace

const CheckpointPart* Checkpoint::find(const std::string& name) const {
  const auto found = std::ranges::find(parts, name, &CheckpointPart::name);
  return found == parts.end() ? nullptr : &*found;
}

Result<void> write_checkpoint(const fs::path& file, const Checkpoint& checkpoint) {
  ByteCounter counter;
  write_body(counter, checkpoint);
  ByteWriter writer;
  writer.reserve(counter.count());
  write_body(writer, checkpoint);
  const std::vector<std::byte> body = writer.take();
  Head head;
  head.body = body.size();
  head.checksum = checksum_of(head, body);

  auto out = AtomicFile::create(file);
  if (!out) return std::unexpected(out.error());
  out->write(&head, sizeof head);
  out->write(body.data(), body.size());
  return out->commit();
}

Result<Checkpoint> read_checkpoint(const fs::path& file, const CheckpointIdentity& expected) {
  const auto content = read_input(file, "the checkpoint of a run", kMostBytes);
  if (!content) return std::unexpected(content.error());
  const std::span<const std::byte> all = std::as_bytes(std::span(*content));
  Head head;
  ByteReader reader(all);
  read(reader, head);
  if (reader.failed() || head.magic != kMagic)
    return failure(file.string() + ": found no checkpoint, expected that of a run");
  if (head.format != kFormat)
    return failure(fmt::format("{}: found a checkpoint of format {}, expected {}", file.string(),
                               head.format, kFormat));
  const std::span<const std::byte> body = all.subspan(sizeof head);
  if (body.size() != head.body)
    return failure(fmt::format("{}: found {} bytes, expected {}: it is cut off or damaged",
                               file.string(), body.size(), head.body));
  if (head.checksum != checksum_of(head, body))
    return failure(file.string() + ": found another checksum than expected: it is damaged");
  Checkpoint checkpoint;
  if (!read_body(body, checkpoint))
    return failure(file.string() + ": found parts that don't fit together: it is damaged");
  if (auto same = check_identity(file, checkpoint.identity, expected); !same)
    return std::unexpected(same.error());
  return checkpoint;
}

std::string machine_kind() {
  return fmt::format("{} ({} bit, {} endian)", this_machine().cpu, 8 * sizeof(void*),
                     std::endian::native == std::endian::little ? "little" : "big");
}

}  // namespace viscera
