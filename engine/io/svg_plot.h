// Line plots and tables as SVG text, with no library behind them.
#pragma once

#include <string>
#include <vector>

#include "kernels/base/types.h"

namespace viscera {

struct PlotSeries {
  std::string name;          ///< in the legend; empty: not there
  std::vector<Vec2> points;  ///< in data units; those an axis can't show are left out
  bool line = true, markers = true;
  bool dashed = false, hollow = false;
  int colour = -1;  ///< of the palette; -1: the next free one
};

struct PlotAxis {
  std::string label;  ///< with its unit
  bool logarithmic = false;
  double low = 0.0, high = 0.0;  ///< equal: from the data
};

struct Plot {
  std::string title, subtitle;
  PlotAxis x, y;
  std::vector<PlotSeries> series;
  bool equal_scales = false;  ///< a unit is as long up as across (linear axes)
};

/// A picture of 760 x 500; readable on white and alone.
std::string to_svg(const Plot& plot);

struct PlotTable {
  std::string title;
  std::vector<std::string> headings;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> notes;  ///< under the table, one a line
};
std::string to_svg(const PlotTable& table);

}  // namespace viscera
