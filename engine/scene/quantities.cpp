#include "engine/scene/quantities.h"

#include <utility>

namespace viscera {

KeySpec quantity(std::string name, std::string unit, double least, double greatest,
                 std::string description) {
  ObjectSpec spec;
  spec.keys = {
      number("value", "In the unit beside it.").needed().between(least, greatest),
      text("unit", "SI, or 1 for a plain number.").needed().one_of({unit}),
      text("source", "Where the value was read or computed, or what it rests on.").needed(),
      text("mark",
           "V: verified in the source; A: of the source only the abstract was read; R: recalled, "
           "to be checked; E: chosen by eye.")
          .needed()
          .one_of({"V", "A", "R", "E"}),
  };
  return object(std::move(name), std::move(description), std::move(spec));
}

double value_of(const Json& quantity) {
  return quantity["value"].get<double>();
}

}  // namespace viscera
