#include "tools/stress/stress_cases.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "kernels/points/node_placement.h"

namespace viscera {
namespace {

using Lines = std::array<std::vector<double>, 3>;  // where the grid lines cut each edge, 0 to 1

std::vector<double> even_lines(int divisions) {
  std::vector<double> lines;
  for (int i = 0; i <= divisions; ++i) lines.push_back(static_cast<double>(i) / divisions);
  return lines;
}

/// The unit cube's surface with these grid lines on its faces; outward.
TriangleSurface unit_cube(const Lines& lines) {
  TriangleSurface surface;
  std::map<std::array<int, 3>, int> vertex_at;
  const auto vertex = [&](std::array<int, 3> at) {
    const auto [entry, fresh] =
        vertex_at.try_emplace(at, static_cast<int>(surface.vertices.size()));
    if (fresh) {
      Vec3 place;
      for (std::size_t a = 0; a < 3; ++a)
        place[static_cast<int>(a)] = lines[a][static_cast<std::size_t>(at[a])];
      surface.vertices.push_back(place);
    }
    return entry->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const bool far_side : {false, true}) {
      for (std::size_t i = 0; i + 1 < lines[u].size(); ++i) {
        for (std::size_t j = 0; j + 1 < lines[v].size(); ++j) {
          std::array<int, 3> at{};
          at[axis] = far_side ? static_cast<int>(lines[axis].size()) - 1 : 0;
          const auto corner = [&](std::size_t di, std::size_t dj) {
            at[u] = static_cast<int>(i + di);
            at[v] = static_cast<int>(j + dj);
            return vertex(at);
          };
          const int a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (far_side) {
            surface.triangles.insert(surface.triangles.end(), {{a, b, c}, {a, c, d}});
          } else {
            surface.triangles.insert(surface.triangles.end(), {{a, c, b}, {a, d, c}});
          }
        }
      }
    }
  }
  return surface;
}

void append(TriangleSurface& to, const TriangleSurface& from, const Vec3& shift) {
  const int base = static_cast<int>(to.vertices.size());
  for (const Vec3& v : from.vertices) to.vertices.push_back(v + shift);
  for (const auto& t : from.triangles)
    to.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

/// Nodes with the surface ones marked; the cloud wants those first.
struct Nodes {
  std::vector<Vec3> positions;
  std::vector<char> on_surface;
  void add(const Vec3& x, bool surface) {
    positions.push_back(x);
    on_surface.push_back(surface);
  }
  std::size_t size() const { return positions.size(); }
};

Nodes nodes_of(const PointCloud& cloud) {
  Nodes nodes;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    nodes.add(cloud.positions[i], i < cloud.surface_count);
  return nodes;
}

PointCloud cloud_of(const Nodes& nodes) {
  PointCloud cloud;
  for (const bool wanted : {true, false})
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (static_cast<bool>(nodes.on_surface[i]) == wanted)
        cloud.positions.push_back(nodes.positions[i]);
  cloud.surface_count = static_cast<std::size_t>(
      std::count_if(nodes.on_surface.begin(), nodes.on_surface.end(), [](char c) { return c; }));
  cloud.spacings = measure_spacings(cloud.positions);
  return cloud;
}

/// About so many nodes come of this spacing: half a layer more than the volume's on the surface.
double spacing_for(const TriangleSurface& surface, double nodes) {
  const double v = volume(surface), a = area(surface);
  double low = 1e-3 * std::cbrt(v), high = 10.0 * std::cbrt(v);
  for (int i = 0; i < 60; ++i) {
    const double h = std::sqrt(low * high);
    (v / (h * h * h) + 0.5 * a / (h * h) > nodes ? low : high) = h;
  }
  return low;
}

/// A grid over the box, its outermost layers on the faces. Fewest: layers of an edge at least.
Nodes lattice(const Vec3& edges, double h, int fewest) {
  Eigen::Array3i count;
  for (int a = 0; a < 3; ++a)
    count[a] = std::max(fewest, 1 + static_cast<int>(std::lround(edges[a] / h)));
  Nodes nodes;
  for (int k = 0; k < count.z(); ++k)
    for (int j = 0; j < count.y(); ++j)
      for (int i = 0; i < count.x(); ++i) {
        const Eigen::Array3i at(i, j, k);
        const Eigen::Array3d share = at.cast<double>() / (count - 1).max(1).cast<double>();
        const bool outermost = (at == 0).any() || (at == count - 1).any();
        nodes.add(edges.cwiseProduct(share.matrix()), outermost);
      }
  return nodes;
}

Vec3 random_surface_place(const TriangleSurface& surface, Draws& draws) {
  // Areas differ: a triangle is taken with the probability of its area.
  double left = draws.uniform() * area(surface);
  std::size_t t = 0;
  for (; t + 1 < surface.triangles.size(); ++t) {
    left -= area_vector(surface, static_cast<int>(t)).norm();
    if (left < 0.0) break;
  }
  double u = draws.uniform(), v = draws.uniform();
  if (u + v > 1.0) {
    u = 1.0 - u;
    v = 1.0 - v;
  }
  return position(surface, {static_cast<int>(t), Vec3(1.0 - u - v, u, v)});
}

Nodes scattered(const TriangleSurface& surface, const SurfaceTree& tree, double h, Draws& draws) {
  Nodes nodes;
  const int outside = static_cast<int>(area(surface) / (h * h));
  const int inside = static_cast<int>(volume(surface) / (h * h * h));
  for (int i = 0; i < outside; ++i) nodes.add(random_surface_place(surface, draws), true);
  const Box box = bounds(surface);
  for (int i = 0, tries = 0; i < inside && tries < 100 * inside; ++tries) {
    const Vec3 x(draws.uniform(), draws.uniform(), draws.uniform());
    const Vec3 at = box.min() + box.sizes().cwiseProduct(x);
    if (tree.signed_distance(at) >= 0.0) continue;
    nodes.add(at, false);
    ++i;
  }
  return nodes;
}

/// Shape before it is turned and moved: base at z = 0, greatest edge `size`.
struct Shape {
  TriangleSurface surface;
  Vec3 edges = Vec3::Ones();
  bool is_box = false;
  std::string name;
};

Shape box_shape(const Vec3& edges, const Lines& lines, std::string name) {
  Shape shape{unit_cube(lines), edges, true, std::move(name)};
  for (Vec3& v : shape.surface.vertices) v = v.cwiseProduct(edges);
  return shape;
}

Shape ordinary_box(const Vec3& edges) {
  return box_shape(edges, {even_lines(5), even_lines(5), even_lines(5)}, "box");
}

Shape ellipsoid(const Vec3& edges) {
  Shape shape{unit_cube({even_lines(7), even_lines(7), even_lines(7)}), edges, false, "ellipsoid"};
  for (Vec3& v : shape.surface.vertices) {
    const Vec3 centred = (v - Vec3::Constant(0.5)).normalized();
    v = 0.5 * (centred + Vec3::Ones()).cwiseProduct(edges);
  }
  return shape;
}

Vec3 random_edges(Draws& draws, double size) {
  Vec3 edges(draws.uniform(0.4, 1.0), draws.uniform(0.4, 1.0), draws.uniform(0.4, 1.0));
  edges[draws.below(3)] = 1.0;
  return size * edges;
}

Shape make_shape(StressKind kind, double size, Draws& draws) {
  const Vec3 edges = random_edges(draws, size);
  switch (kind) {
    case StressKind::kLattice: {
      // Every other one a cube: the most symmetric of all.
      return ordinary_box(draws.chance(0.5) ? Vec3::Constant(size) : edges);
    }
    case StressKind::kSliverTriangles: {
      Lines lines;
      for (auto& axis : lines) {
        axis = even_lines(3 + draws.below(3));
        const int needles = 1 + draws.below(3);
        for (int i = 0; i < needles; ++i) {
          const double at = axis[static_cast<std::size_t>(1 + draws.below(2))];
          axis.push_back(at + draws.log_uniform(1e-6, 3e-2));
        }
        std::sort(axis.begin(), axis.end());
        axis.erase(std::unique(axis.begin(), axis.end()), axis.end());
      }
      return box_shape(edges, lines, "box with needles");
    }
    case StressKind::kSliverBody: {
      Shape shape = ordinary_box(edges);
      const double thin = draws.log_uniform(1e-3, 0.2);
      for (Vec3& v : shape.surface.vertices) v.z() *= 1.0 - (1.0 - thin) * v.x() / edges.x();
      shape.name = fmt::format("wedge down to {:.2g} of its height", thin);
      shape.is_box = false;
      return shape;
    }
    case StressKind::kThinWall: {
      Vec3 wall = edges;
      wall.z() = size * draws.log_uniform(0.02, 0.3);
      return box_shape(wall, {even_lines(8), even_lines(8), even_lines(1)}, "wall");
    }
    case StressKind::kDisconnected: {
      Vec3 half = edges;
      half.x() *= 0.45;
      const Shape piece = box_shape(half, {even_lines(4), even_lines(4), even_lines(4)}, "");
      const double gap = size * draws.log_uniform(1e-3, 0.5);
      Shape shape{piece.surface, edges, false, fmt::format("two boxes {:.2g} m apart", gap)};
      append(shape.surface, piece.surface, Vec3(half.x() + gap, 0.0, 0.0));
      shape.edges = bounds(shape.surface).sizes();
      return shape;
    }
    default:
      return draws.chance(0.5) ? ordinary_box(edges) : ellipsoid(edges);
  }
}

void double_some_nodes(Nodes& nodes, double distance, Draws& draws, double h) {
  const int pairs = 1 + draws.below(4);
  for (int i = 0; i < pairs; ++i) {
    const auto node = static_cast<std::size_t>(draws.below(static_cast<int>(nodes.size())));
    const Vec3 off = distance * h * draws.direction();
    // A shifted surface node would leave the surface: its twin counts as an inner one.
    nodes.add(nodes.positions[node] + off, distance == 0.0 && nodes.on_surface[node]);
  }
}

Result<PointCloud> make_cloud(StressKind kind, const Shape& shape, double nodes_wanted,
                              Draws& draws, std::string& note, bool& to_be_refused) {
  const SurfaceTree tree(shape.surface);
  const double h = spacing_for(shape.surface, nodes_wanted);
  const auto placed = [&](const SpacingField& spacing) {
    NodePlacement options;
    options.seed = 1 + static_cast<std::uint64_t>(draws.below(1000));
    options.max_nodes = 2000;
    return place_nodes(shape.surface, tree, spacing, options, no_progress());
  };
  const auto even = [&] { return placed([h](const Vec3&) { return h; }); };
  switch (kind) {
    case StressKind::kGraded: {
      const Vec3 fine = random_surface_place(shape.surface, draws);
      note = ", graded";
      return placed(graded_spacing(1.4 * h, 1.4 * h / 6.0, 0.25, {fine}));
    }
    case StressKind::kLattice:
      return cloud_of(lattice(shape.edges, h, 3));
    case StressKind::kScattered:
      return cloud_of(scattered(shape.surface, tree, h, draws));
    case StressKind::kCoincident:
    case StressKind::kNearlyCoincident: {
      auto cloud = even();
      if (!cloud) return cloud;
      Nodes nodes = nodes_of(*cloud);
      const double distance = kind == StressKind::kCoincident
                                  ? 0.0
                                  : draws.log_uniform(draws.chance(0.5) ? 1e-10 : 0.03, 0.5);
      note = fmt::format(", pairs {:.2g} h apart", distance);
      // A twentieth is expected of the spacing, which the pair itself makes smaller.
      to_be_refused = distance < 0.03;
      double_some_nodes(nodes, distance, draws, h);
      return cloud_of(nodes);
    }
    case StressKind::kClustered: {
      auto cloud = even();
      if (!cloud) return cloud;
      Nodes nodes = nodes_of(*cloud);
      const Vec3 centre =
          nodes.positions[static_cast<std::size_t>(draws.below(static_cast<int>(nodes.size())))];
      const double radius = h * draws.log_uniform(draws.chance(0.5) ? 1e-3 : 0.2, 1.0);
      const int crowd = 3 + draws.below(18);
      note = fmt::format(", {} nodes within {:.2g} h", crowd, radius / h);
      for (int i = 0; i < crowd; ++i)
        nodes.add(centre + radius * std::cbrt(draws.uniform()) * draws.direction(), false);
      return cloud_of(nodes);
    }
    case StressKind::kThinWall: {
      const int layers = draws.below(4);
      if (layers == 0) {
        // One layer, in the middle: no field can tell how a plane of nodes is to bend.
        note = ", one plane of nodes";
        to_be_refused = true;
        Nodes grid = lattice(Vec3(shape.edges.x(), shape.edges.y(), 0.0), h, 1);
        Nodes plane;
        for (const Vec3& x : grid.positions)
          plane.add(Vec3(x.x(), x.y(), 0.5 * shape.edges.z()), false);
        return cloud_of(plane);
      }
      if (layers == 1) {
        note = ", a layer of nodes on each face";
        // As far apart as the wall is thick, or up to twice that, but not more nodes than wanted.
        const double across = std::max(shape.edges.z() * draws.uniform(1.0, 2.0),
                                       std::sqrt(2.0 * shape.edges.x() * shape.edges.y() / 400.0));
        Nodes nodes;
        for (const Vec3& x :
             lattice(Vec3(shape.edges.x(), shape.edges.y(), 0.0), across, 1).positions)
          for (const double z : {0.0, shape.edges.z()}) nodes.add(Vec3(x.x(), x.y(), z), true);
        return cloud_of(nodes);
      }
      note = ", placed";
      return even();
    }
    default:
      return even();
  }
}

}  // namespace

double Draws::log_uniform(double low, double high) {
  return low * std::pow(high / low, uniform());
}

std::string_view stress_kind_name(StressKind kind) {
  static constexpr std::array<std::string_view, kStressKinds> kNames = {
      "placed",    "graded",           "lattice",
      "scattered", "coincident",       "nearly_coincident",
      "clustered", "sliver_triangles", "sliver_body",
      "thin_wall", "disconnected",     "stiffness_jump"};
  return kNames[static_cast<std::size_t>(kind)];
}

StressBody make_stress_body(std::uint64_t seed, int number) {
  Draws draws(seed, static_cast<std::uint64_t>(number));
  StressBody body;
  body.kind = static_cast<StressKind>(number % kStressKinds);
  const std::vector<std::string> names = formulation_names();
  body.formulation = names[static_cast<std::size_t>(number / kStressKinds) % names.size()];

  static constexpr std::array kRatios = {0.0, 0.3, 0.45, 0.49, 0.499};
  body.material.poisson_ratio = draws.chance(0.5)
                                    ? kRatios[static_cast<std::size_t>(draws.below(kRatios.size()))]
                                    : draws.uniform(0.0, 0.499);
  body.material.youngs_modulus = draws.log_uniform(10.0, 1e7);
  body.size = draws.log_uniform(1e-3, 1.0);
  if (body.kind == StressKind::kStiffnessJump) {
    body.second_stiffness = 1000.0;
    body.material.youngs_modulus = draws.log_uniform(10.0, 1e4);
  }

  Shape shape = make_shape(body.kind, body.size, draws);
  body.thickness = shape.edges.minCoeff();
  std::string note;
  auto cloud =
      make_cloud(body.kind, shape, draws.uniform(60.0, 220.0), draws, note, body.to_be_refused);
  // gfdm.cpp: above it its error grows without bound.
  if (body.formulation == "gfdm" && body.material.poisson_ratio > 0.45) body.to_be_refused = true;

  // How the body is held and where it may be touched, in its own frame.
  const double height = shape.edges.z(), length = shape.edges.x();
  std::function<bool(const Vec3&)> held, touchable;
  std::string hold;
  if (body.kind == StressKind::kThinWall) {
    held = [=](const Vec3& x) { return x.x() < 0.2 * length; };
    touchable = [=](const Vec3& x) { return x.x() > 0.4 * length; };
    hold = "held at one end";
  } else if (body.kind == StressKind::kDisconnected && draws.chance(0.3)) {
    held = [=](const Vec3& x) { return x.z() < 1e-6 * height && x.x() < 0.5 * length; };
    touchable = [=](const Vec3& x) { return x.z() > 0.5 * height; };
    hold = "one piece held";
  } else if (shape.name != "ellipsoid" && draws.chance(0.7)) {
    held = [=](const Vec3& x) { return x.z() < 1e-6 * height; };
    // On a wedge the touchable part must stay clear of the base: its thin end is left out.
    const double least = body.kind == StressKind::kSliverBody ? 0.1 : 0.4;
    touchable = [=](const Vec3& x) { return x.z() > least * height; };
    hold = "held by its base";
    body.base_is_plane = true;
  } else {
    held = [=](const Vec3& x) { return x.z() < 0.25 * height; };
    touchable = [=](const Vec3& x) { return x.z() > 0.4 * height; };
    hold = "held below a quarter of its height";
  }

  Mat3 turn = Mat3::Identity();
  Vec3 shift = Vec3::Zero();
  if (draws.chance(0.5)) {
    turn = Eigen::AngleAxisd(draws.uniform(0.0, std::numbers::pi), draws.direction())
               .toRotationMatrix();
    shift = 3.0 * body.size * draws.uniform() * draws.direction();
  }
  body.up = turn.col(2);
  body.origin = shift;
  body.is_fixed = [=](const Vec3& x) { return held(turn.transpose() * (x - shift)); };
  body.is_touchable = [=](const Vec3& x) { return touchable(turn.transpose() * (x - shift)); };
  body.surface = std::move(shape.surface);
  for (Vec3& v : body.surface.vertices) v = turn * v + shift;
  if (cloud) {
    body.cloud = std::move(*cloud);
    for (Vec3& x : body.cloud.positions) x = turn * x + shift;
  } else {
    body.refused = cloud.error().text();
  }
  body.description =
      fmt::format("{}: {}, {:.3g} x {:.3g} x {:.3g} m, {} nodes{}, {}, E {:.3g} Pa, nu {:.4g}, {}",
                  stress_kind_name(body.kind), shape.name, shape.edges.x(), shape.edges.y(),
                  shape.edges.z(), body.cloud.size(), note, hold, body.material.youngs_modulus,
                  body.material.poisson_ratio, body.formulation);
  return body;
}

}  // namespace viscera
