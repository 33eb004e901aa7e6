// An organ's model in the cache of prepared responses.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/io/response_cache.h"
#include "engine/organ/organ_model.h"
#include "kernels/paff/stiffness_factor.h"

namespace viscera {

/// Cache key of an organ: a hash of everything that goes into its model. That of the shape alone
/// where nothing is demanded of it.
Result<std::string> organ_key(const OrganDescription& organ, const Tissue& tissue,
                              const PreparedShape& shape, const BodyDemand& demand,
                              const PrepareOptions& options);

/// What its file in the cache takes, about what the model will; 0: there is none.
std::uint64_t cached_bytes(const BodyDemand& demand, const std::string& key);

/// `said`: the notes that preparing its elasticity left.
PreparedResponse to_cache(const OrganModel& model, std::span<const std::string> said);

/// Only where columns are left to be made from it; with that of a step at finite strain.
Result<void> save_factor(const ResponseCache& cache, const OrganModel& model,
                         const StiffnessFactor* factor);

/// Fills `model` from the cache; false when there is nothing usable there.
bool load_cached(const ResponseCache& cache, OrganModel& model, const OrganDescription& organ,
                 const Tissue& tissue, const BodyDemand& demand, const PrepareOptions& options,
                 std::vector<std::string>& warnings);

}  // namespace viscera
