// What an instrument feels an organ by.
#pragma once

#include "engine/simulation/components.h"
#include "haptics/hive_tissue.h"

namespace viscera {

/// For an instrument without `haptic`, the default hive. Fails, with key and reason, where its tip
/// isn't a ball.
Result<HiveTissueSettings> hive_settings(const InstrumentDescription& instrument,
                                         const OrganBody& organ, HiveBuilding building);

}  // namespace viscera
