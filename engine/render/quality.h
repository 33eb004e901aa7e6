// How much work goes into a picture.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace viscera {

/// Draft: to find one's way. Review: what a film is judged by. Final: for print.
enum class Quality { kDraft, kReview, kFinal };

/// What a quality costs. On a software driver the cost is that of shaded pixels, so resolution is
/// what is traded first.
struct QualitySettings {
  float scale = 1.0f;  ///< pixels shaded per pixel shown, each way
  int occlusion_samples =
      10;                    ///< a pixel of the occlusion map, which has half the shaded resolution
  int shadow_steps = 6;      ///< on the way from the surface towards the light
  int smoke_columns = 176;   ///< rays through smoke across the picture
  int smoke_slices = 64;     ///< steps on each
  bool smooth_edges = true;  ///< looks for stair-steps in the picture shown
  bool fine_relief = true;   ///< the smallest wave of the tissues' relief
};

QualitySettings settings_of(Quality quality);

std::string name_of(Quality quality);
/// "draft", "review" or "final".
std::optional<Quality> quality_of(std::string_view name);

}  // namespace viscera
