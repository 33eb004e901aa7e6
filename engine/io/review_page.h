// The template of review.html (review_page.html), built into the program.
#pragma once

#include <string_view>

namespace viscera {

/// The page, with "{{run data}}" where the run's JSON goes.
std::string_view review_page();

}  // namespace viscera
