// Measured or assumed values in the project's material files: each with unit, source and mark.
#pragma once

#include <string>

#include "engine/scene/keys.h"

namespace viscera {

/// A key that holds {"value", "unit", "source", "mark"}; mark V: verified in the source, A: of
/// the source only the abstract was read, R: recalled, to be checked, E: chosen by eye.
KeySpec quantity(std::string name, std::string unit, double least, double greatest,
                 std::string description);

/// The number of a valid quantity.
double value_of(const Json& quantity);

}  // namespace viscera
