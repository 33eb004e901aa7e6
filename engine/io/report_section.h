// What a part of the program has to say in report.json.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace viscera {

/// One of its keys and the key's value, as JSON text.
struct ReportSection {
  std::string key, json;
};

/// Text that isn't UTF-8 is mended, numbers that aren't finite become null.
ReportSection report_section(std::string key, const nlohmann::ordered_json& value);

/// Makes one value of two that several wrote under one key: of objects key by key, of lists entry
/// by entry, where entries belong together that begin with the same key and value. Elsewhere the
/// later one stands, but null replaces nothing.
void merge_section(nlohmann::ordered_json& all, nlohmann::ordered_json more);

/// Something that the scene didn't need or the machine couldn't give.
struct SkippedReport {
  std::string what, why;
};

}  // namespace viscera
