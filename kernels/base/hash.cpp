#include "kernels/base/hash.h"

// The running state itself is saved and restored.
#define XXH_STATIC_LINKING_ONLY
#include <xxhash.h>

#include <cstdio>
#include <cstring>

namespace viscera {

struct Hasher::State {
  XXH3_state_t* xxh = XXH3_createState();
  State() { XXH3_128bits_reset(xxh); }
  ~State() { XXH3_freeState(xxh); }
};

Hasher::Hasher() : state_(std::make_unique<State>()) {}
Hasher::~Hasher() = default;

Hasher& Hasher::bytes(const void* data, std::size_t size) {
  if (size > 0) XXH3_128bits_update(state_->xxh, data, size);
  return *this;
}

Hasher& Hasher::text(std::string_view v) {
  value<std::uint64_t>(v.size());
  return bytes(v.data(), v.size());
}

std::string Hasher::hex() const {
  const XXH128_hash_t h = XXH3_128bits_digest(state_->xxh);
  char digits[33];
  std::snprintf(digits, sizeof digits, "%016llx%016llx", static_cast<unsigned long long>(h.high64),
                static_cast<unsigned long long>(h.low64));
  return digits;
}

std::vector<std::byte> Hasher::save() const {
  XXH3_state_t copy = *state_->xxh;
  copy.extSecret = nullptr;                                     // an address of this process
  std::memset(copy.customSecret, 0, sizeof copy.customSecret);  // unused
  std::vector<std::byte> saved(sizeof copy);
  std::memcpy(saved.data(), &copy, sizeof copy);
  return saved;
}

bool Hasher::restore(std::span<const std::byte> saved) {
  XXH3_state_t& own = *state_->xxh;
  XXH3_state_t copy;
  if (saved.size() != sizeof copy) return false;
  std::memcpy(&copy, saved.data(), sizeof copy);
  if (copy.bufferedSize > XXH3_INTERNALBUFFER_SIZE || copy.seed != own.seed ||
      copy.useSeed != own.useSeed || copy.secretLimit != own.secretLimit ||
      copy.nbStripesPerBlock != own.nbStripesPerBlock ||
      copy.nbStripesSoFar > own.nbStripesPerBlock)
    return false;
  copy.extSecret = own.extSecret;
  own = copy;
  return true;
}

}  // namespace viscera
