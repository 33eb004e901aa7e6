// What finite elements found for the bodies of body_cases.h, kept in assets/reference/bodies: some
// take minutes.
#pragma once

#include <filesystem>

#include "engine/verification/body_cases.h"

namespace viscera {

struct KnownBodyReference {
  std::string body;
  BodyLoad load{};
  double poisson_ratio = 0.0;
  BodyReference reference;
};

/// Poisson's ratios that are kept.
inline constexpr std::array kBodyPoissonRatios = {0.30, 0.45, 0.49};

/// forces.csv of the folder, and BODY_LOAD.csv for each body and load in it. Fails, naming file and
/// line, where one is missing or isn't what it should be.
Result<std::vector<KnownBodyReference>> read_body_references(const std::filesystem::path& folder);
/// The same files as text: name and content of each.
std::vector<std::pair<std::string, std::string>> body_reference_files(
    const std::vector<KnownBodyReference>& all);

/// The entry of this case, or nullptr.
const BodyReference* find_reference(const std::vector<KnownBodyReference>& all,
                                    const std::string& body, BodyLoad load, double poisson_ratio);

}  // namespace viscera
