#include "engine/simulation/world.h"

#include <gtest/gtest.h>
