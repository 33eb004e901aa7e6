#include "engine/io/report_section.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

bool belong_together(const Json& a, const Json& b) {
  if (!a.is_object() || !b.is_object() || a.empty() || b.empty()) return false;
  return a.begin().key() == b.begin().key() && a.begin().value() == b.begin().value();
}

}  // namespace

ReportSection report_section(std::string key, const Json& value) {
  return {std::move(key), value.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

void merge_section(Json& all, Json more) {
  if (more.is_null()) return;
  if (all.is_object() && more.is_object()) {
    for (auto& [key, value] : more.items()) merge_section(all[key], std::move(value));
  } else if (all.is_array() && more.is_array()) {
    for (Json& entry : more) {
      const auto same = std::find_if(all.begin(), all.end(),
                                     [&](const Json& one) { return belong_together(one, entry); });
      if (same == all.end())
        all.push_back(std::move(entry));
      else
        merge_section(*same, std::move(entry));
    }
  } else {
    all = std::move(more);
  }
}

}  // namespace viscera
