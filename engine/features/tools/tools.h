// Instruments: where controls put their tips.
#pragma once

#include "engine/simulation/feature.h"

namespace viscera {

Feature tools_feature();

}  // namespace viscera
