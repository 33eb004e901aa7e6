// Organs without a global response: hives alone answer (LPAFF), in place of a prepared compliance.
// Tools press, hold, rub and burn them as any other organ (kernels/hive/hive_contact.h).
//
// Tissue beyond linear, or that relaxes, is felt by hives that travel with each tool, as in a hand
// (haptics/hive_tissue.h): what a path's tool feels there is their force.
#pragma once

#include <memory>
#include <vector>

#include "engine/simulation/feature.h"
#include "haptics/hive_tissue.h"

namespace viscera {

struct LocalBody {
  static constexpr bool kConstant = true;
  std::shared_ptr<const WalkableSurface> walkable;
  HiveSettings hive;  ///< of its contact
};

/// What tools on paths feel of a local organ whose tissue isn't linear or relaxes.
struct LocalFeel {
  static constexpr std::string_view kName = "feel of local organs";
  struct Touch {
    Entity instrument;
    std::unique_ptr<HiveTissue> tissue;
    Vec3 tip = Vec3::Zero();  ///< a frame ago [m]
    static constexpr auto fields() {
      return std::tuple(field("instrument", &Touch::instrument), field("tissue", &Touch::tissue),
                        field("tip", &Touch::tip));
    }
  };
  std::vector<Touch> touches;  ///< one an instrument
  static constexpr auto fields() { return std::tuple(field("touches", &LocalFeel::touches)); }
};
static_assert(fields_cover<LocalFeel::Touch>() && fields_cover<LocalFeel>());

Feature local_feature();

}  // namespace viscera
