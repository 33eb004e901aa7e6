#include "engine/render/instrument_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/scene/scene.h"

namespace viscera {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kRound = 40;  // vertices around a shaft

/// One ring of a body of revolution about +z.
struct Station {
  double z, radius;
};

/// One ellipse of a flattened body along +z: half its size along x and y.
struct FlatStation {
  double z, x, y;
};

/// Builds parts one after another into one mesh.
class Builder {
 public:
  explicit Builder(InstrumentMesh& mesh) : mesh_(mesh) {}

  void triangle(const std::array<Vec3, 3>& p, const std::array<Vec3, 3>& n, Finish finish) {
    for (int i = 0; i < 3; ++i) vertex(p[i], n[i], finish);
  }

  void quad(const std::array<Vec3, 4>& p, const std::array<Vec3, 4>& n, Finish finish) {
    triangle({p[0], p[1], p[2]}, {n[0], n[1], n[2]}, finish);
    triangle({p[0], p[2], p[3]}, {n[0], n[2], n[3]}, finish);
  }

  /// Each pair of neighbouring stations gives a cone with its own normals: turned edges stay crisp.
  void turned(const std::vector<Station>& profile, const Vec3& centre, Finish finish) {
    for (std::size_t s = 0; s + 1 < profile.size(); ++s) {
      const Station a = profile[s], b = profile[s + 1];
      const Vec2 along = Vec2(b.z - a.z, b.radius - a.radius).normalized();
      for (int i = 0; i < kRound; ++i) {
        std::array<Vec3, 2> out, radial;
        for (int k = 0; k < 2; ++k) {
          const double angle = 2.0 * kPi * (i + k) / kRound;
          radial[k] = Vec3(std::cos(angle), std::sin(angle), 0.0);
          out[k] = along[0] * radial[k] - Vec3(0.0, 0.0, along[1]);
        }
        const Vec3 za = centre + Vec3(0, 0, a.z), zb = centre + Vec3(0, 0, b.z);
        quad({za + a.radius * radial[0], za + a.radius * radial[1], zb + b.radius * radial[1],
              zb + b.radius * radial[0]},
             {out[0], out[1], out[1], out[0]}, finish);
      }
    }
  }

  /// Ellipses joined along z, smooth along and around.
  void flattened(const std::vector<FlatStation>& stations, Finish finish) {
    const auto place = [&](std::size_t s, int i) -> Vec3 {
      const double angle = 2.0 * kPi * i / kRound;
      return {stations[s].x * std::cos(angle), stations[s].y * std::sin(angle), stations[s].z};
    };
    const auto normal = [&](std::size_t s, int i) -> Vec3 {
      const FlatStation& a = stations[s > 0 ? s - 1 : 0];
      const FlatStation& b = stations[std::min(s + 1, stations.size() - 1)];
      const double angle = 2.0 * kPi * i / kRound, c = std::cos(angle), d = std::sin(angle);
      if (s == 0) return -Vec3::UnitZ();
      const Vec3 along(c * (b.x - a.x), d * (b.y - a.y), b.z - a.z);
      const Vec3 around(-stations[s].x * d, stations[s].y * c, 0.0);
      return around.cross(along).normalized();
    };
    for (std::size_t s = 0; s + 1 < stations.size(); ++s)
      for (int i = 0; i < kRound; ++i)
        quad({place(s, i), place(s, i + 1), place(s + 1, i + 1), place(s + 1, i)},
             {normal(s, i), normal(s, i + 1), normal(s + 1, i + 1), normal(s + 1, i)}, finish);
  }

  void ball(const Vec3& centre, double radius, Finish finish) {
    constexpr int kBands = 16;
    const auto direction = [](int i, int j) {
      const double polar = kPi * i / kBands, around = 2.0 * kPi * j / kRound;
      return Vec3(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                  -std::cos(polar));
    };
    for (int i = 0; i < kBands; ++i) {
      for (int j = 0; j < kRound; ++j) {
        const std::array<Vec3, 4> n = {direction(i, j), direction(i, j + 1),
                                       direction(i + 1, j + 1), direction(i + 1, j)};
        quad({centre + radius * n[0], centre + radius * n[1], centre + radius * n[2],
              centre + radius * n[3]},
             n, finish);
      }
    }
  }

  /// A round wire along a path in the x-z plane.
  void wire(const std::vector<Vec3>& path, double radius, Finish finish) {
    constexpr int kSides = 20;
    const auto tangent = [&path](std::size_t i) -> Vec3 {
      const std::size_t before = i > 0 ? i - 1 : 0, after = std::min(i + 1, path.size() - 1);
      return (path[after] - path[before]).normalized();
    };
    const auto normal = [&](std::size_t i, int k) -> Vec3 {
      const double angle = 2.0 * kPi * k / kSides;
      const Vec3 across = tangent(i).cross(Vec3::UnitY());
      return std::cos(angle) * across + std::sin(angle) * Vec3::UnitY();
    };
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      for (int k = 0; k < kSides; ++k) {
        const std::array<Vec3, 4> n = {normal(i, k), normal(i, k + 1), normal(i + 1, k + 1),
                                       normal(i + 1, k)};
        quad({path[i] + radius * n[0], path[i] + radius * n[1], path[i + 1] + radius * n[2],
              path[i + 1] + radius * n[3]},
             n, finish);
      }
    }
  }

 private:
  void vertex(const Vec3& position, const Vec3& normal, Finish finish) {
    mesh_.indices.push_back(static_cast<std::uint32_t>(mesh_.vertices.size()));
    mesh_.vertices.push_back(
        {position.cast<float>(), normal.normalized().cast<float>(), static_cast<float>(finish)});
  }

  InstrumentMesh& mesh_;
};

/// Insulated sleeve from z on, with the bevel of its end.
void add_sleeve(Builder& builder, const InstrumentView& view, const Vec3& centre, double z) {
  const double r = view.shaft_radius;
  builder.turned(
      {{z, 0.72 * r}, {z + 0.12 * r, 0.94 * r}, {z + 0.35 * r, r}, {view.shaft_length, r}}, centre,
      Finish::kSleeve);
}

void add_probe(Builder& builder, const InstrumentView& view) {
  const double ball = view.tip_radius, r = view.shaft_radius;
  builder.ball(Vec3::Zero(), ball, Finish::kSteel);
  const double neck = 0.7 * std::min(ball, r);
  const double shoulder = 6.0 * std::max(ball, r);
  builder.turned({{0.0, neck}, {shoulder - r, neck}, {shoulder, 0.96 * r}, {view.shaft_length, r}},
                 Vec3::Zero(), Finish::kSteel);
}

void add_hook(Builder& builder, const InstrumentView& view) {
  const double wire = std::clamp(view.tip_radius, 0.4e-3, 0.8e-3);
  const double reach = 4.5e-3;  // of the bent end across the shaft
  const double bend = 1.6e-3;   // radius of the bend
  const double length = 13e-3;  // of the bare wire along the shaft
  const Vec3 centre(-reach, 0.0, 0.0);
  std::vector<Vec3> path = {Vec3::Zero()};
  for (int i = 0; i <= 12; ++i) {
    const double angle = 0.5 * kPi * i / 12;
    path.push_back(centre +
                   Vec3(bend * (1.0 - std::sin(angle)), 0.0, bend * (1.0 - std::cos(angle))));
  }
  path.push_back(centre + Vec3(0.0, 0.0, length));
  builder.wire(path, wire, Finish::kElectrode);
  builder.ball(Vec3::Zero(), wire, Finish::kElectrode);
  const double r = view.shaft_radius;
  builder.turned({{length - 1e-3, wire},
                  {length - 1e-3, 0.45 * r},
                  {length + 1.5e-3, 0.62 * r},
                  {length + 3e-3, 0.68 * r},
                  {length + 4e-3, 0.68 * r}},
                 centre, Finish::kSteel);
  add_sleeve(builder, view, centre, length + 3.5e-3);
}

/// A blade as wide as the tip, its flat side towards +x, that narrows to the wire that bears it.
void add_spatula(Builder& builder, const InstrumentView& view) {
  const double r = view.shaft_radius, wide = view.tip_radius, thick = 0.4 * wide;
  const double wire = std::min(0.45 * r, wide), blade = 9e-3, neck = 13e-3;
  std::vector<FlatStation> stations;
  constexpr int kNose = 10, kTaper = 8;
  for (int i = 0; i <= kNose; ++i) {
    const double angle = 0.5 * kPi * i / kNose;
    stations.push_back({-wide * std::cos(angle), thick * std::sin(angle), wide * std::sin(angle)});
  }
  for (int i = 0; i <= kTaper; ++i) {
    const double t = static_cast<double>(i) / kTaper, eased = t * t * (3.0 - 2.0 * t);
    stations.push_back(
        {blade + t * (neck - blade), thick + eased * (wire - thick), wide + eased * (wire - wide)});
  }
  builder.flattened(stations, Finish::kElectrode);
  builder.turned({{neck - 1e-3, 0.45 * r}, {neck + 1.5e-3, 0.62 * r}, {neck + 4e-3, 0.68 * r}},
                 Vec3::Zero(), Finish::kSteel);
  add_sleeve(builder, view, Vec3::Zero(), neck + 3.5e-3);
}

/// A pointed blade: its edge lies straight along the shaft, from the tip on, and looks towards +x;
/// its back slants to the tip. Behind it a neck goes over into the handle.
void add_scalpel(Builder& builder, const InstrumentView& view) {
  constexpr double kDepth = 4.5e-3, kThick = 0.4e-3, kNeck = 6e-3;
  constexpr int kStations = 24;
  const double length = view.blade_length, r = view.shaft_radius;
  const auto back = [&](double z) -> double { return -kDepth * std::min(1.0, z / (0.7 * length)); };
  for (const double side : {-0.5, 0.5}) {
    const Vec3 flat = Vec3(0.5 * kThick / kDepth, side > 0.0 ? 1.0 : -1.0, 0.0).normalized();
    for (int i = 0; i < kStations; ++i) {
      const double a = length * i / kStations, b = length * (i + 1) / kStations;
      const Vec3 edge_a(0.0, 0.0, a), edge_b(0.0, 0.0, b);
      const Vec3 back_a(back(a), side * kThick, a), back_b(back(b), side * kThick, b);
      builder.quad({edge_a, back_a, back_b, edge_b}, {flat, flat, flat, flat}, Finish::kSteel);
      if (side > 0.0) continue;
      const Vec3 out = Vec3(-(b - a), 0.0, back(b) - back(a)).normalized();
      const Vec3 across(0.0, kThick, 0.0);
      builder.quad({back_a, Vec3(back_a + across), Vec3(back_b + across), back_b},
                   {out, out, out, out}, Finish::kSteel);
    }
  }
  builder.turned({{length - 0.5e-3, 0.0},
                  {length - 0.5e-3, 0.35 * r},
                  {length + kNeck, 0.8 * r},
                  {length + kNeck + 1.5e-3, r},
                  {view.shaft_length, r}},
                 Vec3::Zero(), Finish::kSteel);
}

/// One of two blades that swing about the hinge, across the shaft: its edge looks at the other one.
void add_scissor_blade(Builder& builder, const InstrumentView& view, double angle, double sign) {
  constexpr double kThick = 1.0e-3;
  constexpr int kStations = 16;
  const double length = view.blade_length, c = std::cos(angle), s = std::sin(angle);
  const auto place = [&](double along, double away, double across) -> Vec3 {
    // From the hinge towards the tip, `away` from the edge.
    const double x = s * along + c * away, z = length - (c * along - s * away);
    return {sign * x, sign * across, z};
  };
  const auto deep = [&](double along) { return 2.2e-3 * (1.0 - 0.75 * along / length); };
  for (int i = 0; i < kStations; ++i) {
    const double a = length * i / kStations, b = length * (i + 1) / kStations;
    for (const double side : {0.0, 1.0}) {
      const Vec3 n(0.0, sign * (side > 0.0 ? 1.0 : -1.0), 0.0);
      builder.quad({place(a, 0, 0), place(a, deep(a), side * kThick),
                    place(b, deep(b), side * kThick), place(b, 0, 0)},
                   {n, n, n, n}, Finish::kSteel);
    }
    const Vec3 out(sign * c, 0.0, s);
    builder.quad({place(a, deep(a), 0), place(a, deep(a), kThick), place(b, deep(b), kThick),
                  place(b, deep(b), 0)},
                 {out, out, out, out}, Finish::kSteel);
  }
}

void add_scissors(Builder& builder, const InstrumentView& view) {
  const double hinge = view.blade_length, r = view.shaft_radius;
  const double angle = kScissorsOpen * std::clamp(view.jaw, 0.0, 1.0);
  add_scissor_blade(builder, view, angle, 1.0);
  add_scissor_blade(builder, view, angle, -1.0);
  builder.ball(Vec3(0.0, 0.0, hinge), 0.6 * r, Finish::kSteel);
  builder.turned({{hinge, 0.5 * r}, {hinge + 3e-3, 0.9 * r}, {hinge + 9.5e-3, 0.92 * r}},
                 Vec3::Zero(), Finish::kSteel);
  add_sleeve(builder, view, Vec3::Zero(), hinge + 9e-3);
}

/// One jaw, closed, on the +x side, lying from the tip (z = 0) to the hinge.
void add_jaw(Builder& builder, const InstrumentView& view, double hinge, double angle,
             double sign) {
  constexpr int kTeeth = 14;
  constexpr int kArc = 10;  // pieces of the jaw's back
  const double width = 0.86 * view.shaft_radius;
  const double tooth = 0.28e-3;
  // A turn about the hinge's axis (y) opens the jaw; `sign` mirrors it to the other side.
  const auto place = [&](const Vec3& p) -> Vec3 {
    const double c = std::cos(angle), s = std::sin(angle);
    const double x = c * p.x() + s * (hinge - p.z()), back = c * (hinge - p.z()) - s * p.x();
    return Vec3(sign * x, sign * p.y(), hinge - back);
  };
  const auto turn = [&](const Vec3& n) -> Vec3 {
    const double c = std::cos(angle), s = std::sin(angle);
    return Vec3(sign * (c * n.x() - s * n.z()), sign * n.y(), c * n.z() + s * n.x());
  };
  // The rounded nose, then a slow swell towards the hinge.
  const auto shape = [&](double z) {
    const double nose = std::sqrt(std::clamp(1.0 - std::pow(1.0 - z / 3e-3, 2.0), 0.0, 1.0));
    const double rise = z < 3e-3 ? nose : 1.0;
    const double taper = 0.62 + 0.38 * std::clamp(z / hinge, 0.0, 1.0);
    return Vec2(width * taper * rise, 0.95 * width * taper * rise);
  };
  const int stations = 4 * kTeeth;
  const auto inner = [&](int i) {
    const double z = hinge * i / stations;
    const bool toothed = z > 0.8e-3 && z < 0.8 * hinge;
    const double phase = static_cast<double>(i % 4) / 4.0;
    return toothed ? tooth * (phase < 0.5 ? 2.0 * phase : 2.0 - 2.0 * phase) : 0.0;
  };
  const auto back = [&](int i, int k) -> std::array<Vec3, 2> {
    const double z = hinge * i / stations, around = kPi * k / kArc;
    const Vec2 half = shape(z);
    const Vec3 p(inner(i) * (k == 0 || k == kArc) + half[1] * std::sin(around),
                 -half[0] * std::cos(around), z);
    const double slope = z < 3e-3 ? -0.8 * (1.0 - z / 3e-3) : -0.06;
    return {place(p), turn(Vec3(std::sin(around), -std::cos(around), slope))};
  };
  for (int i = 0; i < stations; ++i) {
    for (int k = 0; k < kArc; ++k) {
      const auto a = back(i, k), b = back(i, k + 1), c = back(i + 1, k + 1), d = back(i + 1, k);
      builder.quad({a[0], b[0], c[0], d[0]}, {a[1], b[1], c[1], d[1]}, Finish::kSteel);
    }
    const auto a = back(i, 0)[0], b = back(i, kArc)[0];
    const auto c = back(i + 1, kArc)[0], d = back(i + 1, 0)[0];
    const double rise = (inner(i + 1) - inner(i)) / (hinge / stations);
    const Vec3 n = turn(Vec3(-1.0, 0.0, rise));
    builder.quad({a, d, c, b}, {n, n, n, n}, Finish::kSteel);
  }
}

void add_grasper(Builder& builder, const InstrumentView& view) {
  const double hinge = 19e-3, r = view.shaft_radius;
  const double angle = std::clamp(view.jaw, 0.0, 1.0) * 25.0 * kPi / 180.0;
  add_jaw(builder, view, hinge, angle, 1.0);
  add_jaw(builder, view, hinge, angle, -1.0);
  builder.ball(Vec3(0.0, 0.0, hinge), 0.8 * r, Finish::kSteel);
  builder.turned({{hinge - 0.5e-3, 0.55 * r},
                  {hinge + 1.5e-3, 0.9 * r},
                  {hinge + 8e-3, 0.92 * r},
                  {hinge + 9.5e-3, 0.92 * r}},
                 Vec3::Zero(), Finish::kSteel);
  add_sleeve(builder, view, Vec3::Zero(), hinge + 9e-3);
}

/// A sprung ring beyond the tip, which closes to a slit along the shaft, and the film that hangs
/// from it towards +x, seen from both sides.
void add_bag(Builder& builder, const InstrumentView& view) {
  constexpr int kSides = 12, kDown = 16;
  constexpr double kWire = 0.8e-3, kFilm = 0.1e-3, kNearlyShut = 0.06;
  constexpr double kDrawnTogether = 0.5;  // of the depth
  const double radius = view.mouth_radius;
  const double wide = radius * std::max(kNearlyShut, std::clamp(view.jaw, 0.0, 1.0));
  const auto rim = [&](int i) -> Vec3 {
    const double angle = 2.0 * kPi * i / kRound;
    return {0.0, wide * std::sin(angle), -radius + radius * std::cos(angle)};
  };
  const auto out = [&](int i, int k) -> Vec3 {
    const double angle = 2.0 * kPi * i / kRound, around = 2.0 * kPi * k / kSides;
    const Vec3 away = Vec3(0.0, radius * std::sin(angle), wide * std::cos(angle)).normalized();
    return std::cos(around) * away + std::sin(around) * Vec3::UnitX();
  };
  for (int i = 0; i < kRound; ++i)
    for (int k = 0; k < kSides; ++k)
      builder.quad({rim(i) + kWire * out(i, k), rim(i) + kWire * out(i, k + 1),
                    rim(i + 1) + kWire * out(i + 1, k + 1), rim(i + 1) + kWire * out(i + 1, k)},
                   {out(i, k), out(i, k + 1), out(i + 1, k + 1), out(i + 1, k)}, Finish::kSteel);
  // The string draws the mouth together; what lies in the sack keeps that open.
  const auto wide_at = [&](int j) {
    const double t = std::min(1.0, std::sin(0.5 * kPi * j / kDown) / kDrawnTogether);
    return wide + (radius - wide) * t * t * (3.0 - 2.0 * t);
  };
  const auto film = [&](int i, int j) -> Vec3 {
    const double polar = 0.5 * kPi * j / kDown, angle = 2.0 * kPi * i / kRound;
    return {view.sack_depth * std::sin(polar), wide_at(j) * std::sin(angle) * std::cos(polar),
            -radius + radius * std::cos(angle) * std::cos(polar)};
  };
  const auto outward = [&](int i, int j) -> Vec3 {
    const Vec3 place = film(i, j) + Vec3(0.0, 0.0, radius);
    return Vec3(place.x() / (view.sack_depth * view.sack_depth),
                place.y() / (wide_at(j) * wide_at(j)), place.z() / (radius * radius))
        .normalized();
  };
  for (int i = 0; i < kRound; ++i)
    for (int j = 0; j < kDown; ++j) {
      const std::array<Vec3, 4> p = {film(i, j), film(i, j + 1), film(i + 1, j + 1),
                                     film(i + 1, j)};
      const std::array<Vec3, 4> n = {outward(i, j), outward(i, j + 1), outward(i + 1, j + 1),
                                     outward(i + 1, j)};
      builder.quad(p, n, Finish::kSleeve);
      std::array<Vec3, 4> inner;
      for (std::size_t c = 0; c < 4; ++c) inner[c] = p[3 - c] - kFilm * n[3 - c];
      builder.quad(inner, {-n[3], -n[2], -n[1], -n[0]}, Finish::kSleeve);
    }
  add_sleeve(builder, view, Vec3::Zero(), 0.0);
}

/// A wire bent to a U, open away from the shaft.
void add_clip(Builder& builder, const InstrumentView& view) {
  constexpr int kBend = 12;
  const double r = view.tip_radius, half = 0.5 * view.blade_length, x = 0.5 * view.jaw + r;
  std::vector<Vec3> path = {Vec3(-x, 0.0, -half)};
  for (int i = 0; i <= kBend; ++i) {
    const double angle = kPi * i / kBend;
    path.emplace_back(-x * std::cos(angle), 0.0, half + std::min(x, 1e-3) * std::sin(angle));
  }
  path.emplace_back(x, 0.0, -half);
  builder.wire(path, r, Finish::kSteel);
  for (const double side : {-x, x}) builder.ball(Vec3(side, 0.0, -half), r, Finish::kSteel);
}

void add_given_mesh(InstrumentMesh& mesh, const TriangleSurface& surface) {
  const std::vector<Vec3> normals = vertex_normals(surface);
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    mesh.vertices.push_back({surface.vertices[i].cast<float>(), normals[i].cast<float>(),
                             static_cast<float>(Finish::kSteel)});
  }
  for (const std::array<int, 3>& triangle : surface.triangles) {
    for (const int corner : triangle) mesh.indices.push_back(static_cast<std::uint32_t>(corner));
  }
}

}  // namespace

InstrumentMesh make_instrument(const InstrumentView& view) {
  InstrumentMesh mesh;
  Builder builder(mesh);
  switch (view.kind) {
    case InstrumentView::Kind::kProbe:
      add_probe(builder, view);
      break;
    case InstrumentView::Kind::kHook:
      add_hook(builder, view);
      break;
    case InstrumentView::Kind::kSpatula:
      add_spatula(builder, view);
      break;
    case InstrumentView::Kind::kClip:
      add_clip(builder, view);
      break;
    case InstrumentView::Kind::kClipApplier:
    case InstrumentView::Kind::kGrasper:
      add_grasper(builder, view);
      break;
    case InstrumentView::Kind::kBag:
      add_bag(builder, view);
      break;
    case InstrumentView::Kind::kScalpel:
      add_scalpel(builder, view);
      break;
    case InstrumentView::Kind::kScissors:
      add_scissors(builder, view);
      break;
    case InstrumentView::Kind::kMesh:
      if (view.mesh != nullptr) add_given_mesh(mesh, *view.mesh);
      break;
  }
  return mesh;
}

}  // namespace viscera
