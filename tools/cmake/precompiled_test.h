// The same for test programs.
#pragma once

#include <gtest/gtest.h>

#include "tools/cmake/precompiled.h"
