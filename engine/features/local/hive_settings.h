// What an instrument feels an organ by.
#pragma once

#include <span>

#include "engine/simulation/components.h"
#include "haptics/hive_tissue.h"

namespace viscera {

/// Hives know round tips alone. Fails, with the key, for any other.
Result<void> check_round(const TipDescription& tip);

/// For an instrument without `haptic`, the default hive. Fails, with key and reason, where its tip
/// isn't a ball.
Result<HiveTissueSettings> hive_settings(const InstrumentDescription& instrument,
                                         const OrganBody& organ, HiveBuilding building);

/// The hives that an organ's contact stands on (kernels/hive/hive_contact.h): wide enough for what
/// the widest of these tools presses or holds.
HiveSettings contact_hive(std::span<const InstrumentDescription> instruments,
                          const OrganBody& organ);

}  // namespace viscera
