#include "engine/scene/interval.h"

#include "engine/scene/common_keys.h"

namespace viscera {

std::vector<KeySpec> interval_keys() {
  return {number("from_s", "When it starts.").between(0, kLongest_s).otherwise(0.0),
          number("to_s", "When it ends; the end of the scene where it is left out.")
              .between(0, kLongest_s)};
}

ObjectCheck interval_in_order() {
  return {{"from_s", "to_s"},
          [](const Json& values) -> Finding {
            if (values["from_s"] <= values["to_s"]) return {};
            return {{"to_s", "found " + values["to_s"].dump() + ", expected at least from_s, " +
                                 "which is " + values["from_s"].dump()}};
          },
          nullptr};
}

Interval interval_of(const Json& values) {
  Interval when;
  when.from = values["from_s"];
  if (values.contains("to_s")) when.to = values["to_s"];
  return when;
}

}  // namespace viscera
