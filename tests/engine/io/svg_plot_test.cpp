#include "engine/io/svg_plot.h"

#include <gtest/gtest.h>

#include <limits>

namespace viscera {
namespace {

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++found;
  return found;
}

TEST(SvgPlot, LeavesOutWhatALogarithmicAxisCantShow) {
  Plot plot;
  plot.x.logarithmic = plot.y.logarithmic = true;
  const double none = std::numeric_limits<double>::quiet_NaN();
  plot.series = {
      {"one", {{1, 1}, {10, 0.1}, {0, 1}, {-1, 1}, {2, none}}, true, true, false, false, 0}};
  const std::string svg = to_svg(plot);
  EXPECT_EQ(count(svg, "<circle"), 2u + 1u);  // and one in the legend
  EXPECT_EQ(count(svg, "nan"), 0u);
}

TEST(SvgPlot, EscapesTextAndSurvivesWithoutData) {
  Plot plot;
  plot.title = "a < b & c";
  const std::string svg = to_svg(plot);
  EXPECT_NE(svg.find("a &lt; b &amp; c"), std::string::npos);
  EXPECT_EQ(count(svg, "inf"), 0u);
  EXPECT_EQ(svg.substr(svg.size() - 7), "</svg>\n");
}

TEST(SvgPlot, TableHasEveryCell) {
  const std::string svg = to_svg(PlotTable{"t", {"a", "b"}, {{"1", "2"}, {"3", "4"}}, {"note"}});
  for (const char* cell : {">t<", ">a<", ">b<", ">1<", ">2<", ">3<", ">4<", ">note<"})
    EXPECT_EQ(count(svg, cell), 1u) << cell;
}

}  // namespace
}  // namespace viscera
