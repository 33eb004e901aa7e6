#include "engine/render/quality.h"

#include <array>
#include <utility>

namespace viscera {
namespace {

constexpr std::array<std::pair<Quality, std::string_view>, 3> kNames = {
    {{Quality::kDraft, "draft"}, {Quality::kReview, "review"}, {Quality::kFinal, "final"}}};

}  // namespace

QualitySettings settings_of(Quality quality) {
  switch (quality) {
    case Quality::kDraft:
      return {.scale = 0.5f,
              .occlusion_samples = 7,
              .shadow_steps = 3,
              .smoke_columns = 128,
              .smoke_slices = 48,
              .smooth_edges = false,
              .fine_relief = false};
    case Quality::kReview:
      break;
    case Quality::kFinal:
      return {.scale = 2.0f,
              .occlusion_samples = 16,
              .shadow_steps = 10,
              .smoke_columns = 320,
              .smoke_slices = 96,
              .smooth_edges = false,  // its samples have
              .fine_relief = true};
  }
  return {};
}

std::string name_of(Quality quality) {
  for (const auto& [value, name] : kNames)
    if (value == quality) return std::string(name);
  return {};
}

std::optional<Quality> quality_of(std::string_view text) {
  for (const auto& [value, name] : kNames)
    if (name == text) return value;
  return std::nullopt;
}

}  // namespace viscera
