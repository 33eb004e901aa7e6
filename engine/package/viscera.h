// The simulator, for programs of others: find_package(viscera), viscera::viscera.
#pragma once

#include "engine/simulator/simulation.h"
