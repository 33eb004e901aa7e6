// Organs without a global response: hives about the tips are all that answers (LPAFF), and what
// they say of the surface near a tip is what is drawn.
#pragma once

#include <memory>
#include <vector>

#include "engine/simulation/feature.h"
#include "haptics/hive_tissue.h"

namespace viscera {

struct LocalBody {
  static constexpr bool kConstant = true;
  std::shared_ptr<const WalkableSurface> walkable;
};

/// An organ that hives about the tips answer for (LPAFF), in place of a contact with a model.
struct LocalOrgan {
  static constexpr std::string_view kName = "local organs";
  struct Touch {
    Entity instrument;
    std::unique_ptr<HiveTissue> tissue;
    Vec3 tip = Vec3::Zero();    ///< a frame ago [m]
    Vec3 force = Vec3::Zero();  ///< on the tissue, world [N]
    bool pressing = false;
    static constexpr auto fields() {
      return std::tuple(field("instrument", &Touch::instrument), field("tissue", &Touch::tissue),
                        field("tip", &Touch::tip), field("force", &Touch::force),
                        field("pressing", &Touch::pressing));
    }
  };
  std::vector<Touch> touches;  ///< one an instrument
  static constexpr auto fields() { return std::tuple(field("touches", &LocalOrgan::touches)); }
};
static_assert(fields_cover<LocalOrgan::Touch>() && fields_cover<LocalOrgan>());

struct LocalSurface {
  std::unique_ptr<CollisionSurface> surface;  ///< deformed, organ frame
};

Feature local_feature();

}  // namespace viscera
