#include "engine/verification/number_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace viscera {

Result<std::vector<std::vector<double>>> read_number_table(const std::filesystem::path& path,
                                                           std::size_t columns) {
  std::ifstream file(path);
  if (!file) return failure(path.string() + ": can't be read");
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(file, line);
  for (int number = 2; std::getline(file, line); ++number) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::vector<double> row;
    for (double value = 0.0; words >> value;) row.push_back(value);
    if (row.size() != columns || !words.eof()) {
      return failure(fmt::format("{}:{}: found \"{}\", expected {} numbers", path.string(), number,
                                 line, columns));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace viscera
