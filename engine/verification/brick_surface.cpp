#include "engine/verification/brick_surface.h"

#include <array>
#include <cmath>
#include <map>

namespace viscera {

TriangleSurface bricks(const std::vector<double>& x, const std::vector<double>& y,
                       const std::vector<double>& z,
                       const std::function<bool(const Vec3&)>& filled) {
  const std::array<const std::vector<double>*, 3> axes{&x, &y, &z};
  const auto line = [&](int a, int i) {
    return (*axes[static_cast<std::size_t>(a)])[static_cast<std::size_t>(i)];
  };
  using Index = std::array<int, 3>;
  const auto is_filled = [&](const Index& brick) {
    Vec3 centre;
    for (int a = 0; a < 3; ++a) {
      const int i = brick[static_cast<std::size_t>(a)];
      if (i < 0 || i + 1 >= static_cast<int>(axes[static_cast<std::size_t>(a)]->size()))
        return false;
      centre[a] = 0.5 * (line(a, i) + line(a, i + 1));
    }
    return filled(centre);
  };
  TriangleSurface surface;
  std::map<Index, int> numbers;
  const auto vertex = [&](const Index& at) {
    const auto [place, fresh] = numbers.try_emplace(at, static_cast<int>(surface.vertices.size()));
    if (fresh) surface.vertices.emplace_back(line(0, at[0]), line(1, at[1]), line(2, at[2]));
    return place->second;
  };
  for (int k = 0; k + 1 < static_cast<int>(z.size()); ++k)
    for (int j = 0; j + 1 < static_cast<int>(y.size()); ++j)
      for (int i = 0; i + 1 < static_cast<int>(x.size()); ++i) {
        if (!is_filled({i, j, k})) continue;
        for (std::size_t a = 0; a < 3; ++a)
          for (const int side : {0, 1}) {
            Index beyond{i, j, k};
            beyond[a] += side == 1 ? 1 : -1;
            if (is_filled(beyond)) continue;
            const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
            Index corner{i, j, k};
            corner[a] += side;
            std::array<int, 4> quad{};
            constexpr std::array<std::array<int, 2>, 4> kAround{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
            for (std::size_t v = 0; v < 4; ++v) {
              Index at = corner;
              at[b] += kAround[v][0];
              at[c] += kAround[v][1];
              quad[v] = vertex(at);
            }
            if (side == 0) std::swap(quad[1], quad[3]);
            surface.triangles.push_back({quad[0], quad[1], quad[2]});
            surface.triangles.push_back({quad[0], quad[2], quad[3]});
          }
      }
  return surface;
}

std::vector<double> lines(double from, double to, double step) {
  const int count = std::max(1, static_cast<int>(std::ceil((to - from) / step - 1e-9)));
  std::vector<double> out;
  for (int i = 0; i <= count; ++i) out.push_back(from + (to - from) * i / count);
  return out;
}

}  // namespace viscera
