#include "engine/io/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace viscera {
namespace {

// Okabe and Ito's palette: told apart by most eyes.
constexpr std::array kPalette = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                 "#e69f00", "#56b4e9", "#000000", "#8a6d3b"};
constexpr const char* kInk = "#222222";
constexpr const char* kGrid = "#dddddd";
constexpr double kWidth = 760.0, kHeight = 500.0;
constexpr double kLeft = 78.0, kRight = 190.0, kTop = 66.0, kBottom = 58.0;

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  }
  return out;
}

std::string head(double width, double height) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:g}\" height=\"{1:g}\" viewBox=\"0 0 "
      "{0:g} "
      "{1:g}\" font-family=\"DejaVu Sans, Verdana, sans-serif\" font-size=\"12\" fill=\"{2}\">\n"
      "<rect width=\"{0:g}\" height=\"{1:g}\" fill=\"#ffffff\"/>\n",
      width, height, kInk);
}

std::string text(double x, double y, const std::string& what, const std::string& more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\"{}>{}</text>\n", x, y,
                     more.empty() ? "" : " " + more, escaped(what));
}

std::string line(double x1, double y1, double x2, double y2, const char* colour, double width) {
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" "
      "stroke-width=\"{:g}\"/>\n",
      x1, y1, x2, y2, colour, width);
}

/// The nearest of 1, 2, 5, 10, ... below or above.
double tick_beside(double value, bool above) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)));
  const std::array<double, 4> ticks = {unit, 2.0 * unit, 5.0 * unit, 10.0 * unit};
  if (above)
    return *std::find_if(ticks.begin(), ticks.end() - 1, [&](double t) { return t >= value; });
  return *std::find_if(ticks.rbegin(), ticks.rend() - 1, [&](double t) { return t <= value; });
}

/// One axis: data to pixels, and where its ticks stand.
class Scale {
 public:
  Scale(const PlotAxis& axis, double least, double most, double from, double to)
      : log_(axis.logarithmic), from_(from), to_(to) {
    if (axis.low < axis.high) {
      least = axis.low;
      most = axis.high;
    } else if (log_) {
      // Out to the next tick, so that every axis has at least two.
      least = tick_beside(0.97 * least, false);
      most = tick_beside(1.03 * most, true);
    } else {
      const double margin = 0.05 * (most - least);
      least = least >= 0.0 && least < 0.35 * most ? 0.0 : least - margin;
      most += margin;
    }
    low_ = least;
    high_ = most > least ? most : least + 1.0;
  }

  double low() const { return low_; }
  double high() const { return high_; }
  bool shows(double value) const {
    return std::isfinite(value) && value >= low_ * (log_ ? 1 - 1e-9 : 1) - (log_ ? 0 : 1e-9) &&
           value <= high_ * (1 + 1e-9) + 1e-12;
  }
  double pixel(double value) const {
    const double share =
        log_ ? std::log(value / low_) / std::log(high_ / low_) : (value - low_) / (high_ - low_);
    return from_ + share * (to_ - from_);
  }

  std::vector<double> ticks() const {
    std::vector<double> all;
    if (log_) {
      const double decades = std::log10(high_ / low_);
      for (int power = static_cast<int>(std::floor(std::log10(low_)));
           power <= static_cast<int>(std::ceil(std::log10(high_))); ++power) {
        for (const double digit : {1.0, 2.0, 5.0}) {
          if (digit != 1.0 && decades > 3.2) continue;
          const double value = digit * std::pow(10.0, power);
          if (shows(value)) all.push_back(value);
        }
      }
      return all;
    }
    const double raw = (high_ - low_) / 6.0;
    const double unit = std::pow(10.0, std::floor(std::log10(raw)));
    const double step = raw / unit < 1.5   ? unit
                        : raw / unit < 3.5 ? 2 * unit
                        : raw / unit < 7.5 ? 5 * unit
                                           : 10 * unit;
    for (double value = std::ceil(low_ / step - 1e-9) * step; value <= high_ + 1e-9 * step;
         value += step)
      all.push_back(std::abs(value) < 1e-9 * step ? 0.0 : value);
    return all;
  }

 private:
  bool log_;
  double from_, to_, low_ = 0.0, high_ = 1.0;
};

std::string tick_label(double value) {
  if (value == 0.0) return "0";
  const double size = std::abs(value);
  if (size >= 1e7 || size < 1e-4) {
    const int power = static_cast<int>(std::floor(std::log10(size) + 1e-9));
    const double digit = value / std::pow(10.0, power);
    return fmt::format("{:g}e{}", std::round(digit * 1000.0) / 1000.0, power);
  }
  return fmt::format("{:g}", std::round(value * 1e6) / 1e6);
}

std::string marker(std::size_t shape, double x, double y, const char* colour, bool hollow) {
  const double r = 4.0;
  const std::string ink = fmt::format("fill=\"{}\" stroke=\"{}\" stroke-width=\"1.6\"",
                                      hollow ? "#ffffff" : colour, colour);
  switch (shape % 4) {
    case 0:
      return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" {}/>\n", x, y, r, ink);
    case 1:
      return fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"7.4\" height=\"7.4\" {}/>\n",
                         x - 3.7, y - 3.7, ink);
    case 2:
      return fmt::format("<path d=\"M{:.1f} {:.1f}l4.8 8.2h-9.6z\" {}/>\n", x, y - 5.2, ink);
    default:
      return fmt::format("<path d=\"M{:.1f} {:.1f}l5 5l-5 5l-5 -5z\" {}/>\n", x, y - 5.0, ink);
  }
}

}  // namespace

std::string to_svg(const Plot& plot) {
  double low[2] = {std::numeric_limits<double>::infinity(),
                   std::numeric_limits<double>::infinity()};
  double high[2] = {-low[0], -low[1]};
  const bool logarithmic[2] = {plot.x.logarithmic, plot.y.logarithmic};
  for (const PlotSeries& series : plot.series) {
    for (const Vec2& p : series.points) {
      if (!p.allFinite() || (logarithmic[0] && p[0] <= 0.0) || (logarithmic[1] && p[1] <= 0.0))
        continue;
      for (int a = 0; a < 2; ++a) {
        low[a] = std::min(low[a], p[a]);
        high[a] = std::max(high[a], p[a]);
      }
    }
  }
  for (int a = 0; a < 2; ++a) {
    if (low[a] <= high[a]) continue;
    low[a] = logarithmic[a] ? 0.1 : 0.0;
    high[a] = 1.0;
  }
  double right = kWidth - kRight, bottom = kHeight - kBottom;
  Scale x(plot.x, low[0], high[0], kLeft, right);
  Scale y(plot.y, low[1], high[1], bottom, kTop);
  if (plot.equal_scales) {
    const double per_x = (right - kLeft) / (x.high() - x.low());
    const double per_y = (bottom - kTop) / (y.high() - y.low());
    const double unit = std::min(per_x, per_y);
    right = kLeft + unit * (x.high() - x.low());
    const double top = bottom - unit * (y.high() - y.low());
    x = Scale({"", false, x.low(), x.high()}, 0, 1, kLeft, right);
    y = Scale({"", false, y.low(), y.high()}, 0, 1, bottom, top);
  }
  const double top = y.pixel(y.high());

  std::string out = head(kWidth, kHeight);
  out += text(kLeft, 26, plot.title, "font-size=\"16\" font-weight=\"bold\"");
  if (!plot.subtitle.empty()) out += text(kLeft, 46, plot.subtitle, "fill=\"#555555\"");
  for (const double tick : x.ticks()) {
    out += line(x.pixel(tick), top, x.pixel(tick), bottom, kGrid, 1);
    out += text(x.pixel(tick), bottom + 18, tick_label(tick), "text-anchor=\"middle\"");
  }
  for (const double tick : y.ticks()) {
    out += line(kLeft, y.pixel(tick), right, y.pixel(tick), kGrid, 1);
    out += text(kLeft - 8, y.pixel(tick) + 4, tick_label(tick), "text-anchor=\"end\"");
  }
  out += line(kLeft, bottom, right, bottom, kInk, 1);
  out += line(kLeft, top, kLeft, bottom, kInk, 1);
  out += text(0.5 * (kLeft + right), bottom + 42, plot.x.label, "text-anchor=\"middle\"");
  out += text(20, 0.5 * (top + bottom), plot.y.label,
              fmt::format("text-anchor=\"middle\" transform=\"rotate(-90 20 {:.1f})\"",
                          0.5 * (top + bottom)));

  double legend = top + 8;
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    const PlotSeries& series = plot.series[s];
    const std::size_t colour = series.colour >= 0 ? static_cast<std::size_t>(series.colour) : s;
    const char* ink = kPalette[colour % kPalette.size()];
    std::string path, marks;
    bool pen_down = false;
    for (const Vec2& p : series.points) {
      if (!p.allFinite() || !x.shows(p[0]) || !y.shows(p[1])) {
        pen_down = false;
        continue;
      }
      path += fmt::format("{}{:.1f} {:.1f}", pen_down ? "L" : "M", x.pixel(p[0]), y.pixel(p[1]));
      pen_down = true;
      if (series.markers) marks += marker(colour, x.pixel(p[0]), y.pixel(p[1]), ink, series.hollow);
    }
    const char* dash = series.dashed ? " stroke-dasharray=\"6 4\"" : "";
    if (series.line && !path.empty())
      out += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"{}/>\n",
                         path, ink, dash);
    out += marks;
    if (series.name.empty()) continue;
    const double at = right + 16;
    if (series.line)
      out += fmt::format("<path d=\"M{:.1f} {:.1f}h22\" stroke=\"{}\" stroke-width=\"1.8\"{}/>\n",
                         at, legend, ink, dash);
    if (series.markers) out += marker(colour, at + 11, legend, ink, series.hollow);
    out += text(at + 28, legend + 4, series.name);
    legend += 20;
  }
  return out + "</svg>\n";
}

std::string to_svg(const PlotTable& table) {
  constexpr double kLine = 26.0, kPerLetter = 7.4, kGap = 22.0;
  std::vector<double> widths;
  for (std::size_t c = 0; c < table.headings.size(); ++c) {
    std::size_t letters = table.headings[c].size();
    for (const auto& row : table.rows)
      if (c < row.size()) letters = std::max(letters, row[c].size());
    widths.push_back(kPerLetter * static_cast<double>(letters) + kGap);
  }
  double width = 40.0;
  for (const double w : widths) width += w;
  for (const std::string& note : table.notes)
    width = std::max(width, 40.0 + 6.4 * static_cast<double>(note.size()));
  const double height = 70.0 + kLine * static_cast<double>(table.rows.size() + 1) +
                        18.0 * static_cast<double>(table.notes.size()) + 12.0;
  std::string out = head(width, height);
  out += text(20, 30, table.title, "font-size=\"16\" font-weight=\"bold\"");
  double y = 62.0;
  const auto write = [&](const std::vector<std::string>& cells, const char* style) {
    double x = 20.0;
    for (std::size_t c = 0; c < cells.size() && c < widths.size(); ++c) {
      // The first column names, the others are figures.
      const bool left = c == 0;
      out += text(left ? x : x + widths[c] - 8.0, y, cells[c],
                  fmt::format("text-anchor=\"{}\"{}", left ? "start" : "end", style));
      x += widths[c];
    }
    y += kLine;
  };
  write(table.headings, " font-weight=\"bold\"");
  out += line(20, y - 18, width - 20, y - 18, kInk, 1);
  for (const auto& row : table.rows) {
    write(row, "");
    out += line(20, y - 18, width - 20, y - 18, kGrid, 1);
  }
  y += 4.0;
  for (const std::string& note : table.notes) {
    out += text(20, y, note, "font-size=\"11\" fill=\"#555555\"");
    y += 18.0;
  }
  return out + "</svg>\n";
}

}  // namespace viscera
