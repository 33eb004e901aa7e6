#include "engine/features/bag/bag.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "engine/features/contact/tissue_sheet.h"
#include "engine/features/held_tools/held_tools_keys.h"
#include "engine/features/parting/remove_pieces.h"

namespace viscera {
namespace {

/// So much of a piece's vertices must lie in the sack. Chosen: what sticks out a little is pushed
/// in as the mouth is drawn shut.
constexpr double kInSack = 0.95;
/// Places at which a piece is held, and how far apart they are at least, in spacings of its nodes:
/// nearer ones would ask the same nodes for two things.
constexpr std::size_t kMostHolds = 12;
constexpr double kHoldsApart = 1.0;

Result<void> check_bags(const SceneDescription& scene, const std::map<std::string, Tissue>&) {
  Error mistakes;
  const auto wrong = [&](std::size_t i, const char* key, const char* what) {
    mistakes.messages.push_back(
        fmt::format("{}: instruments/{}/{}: {}", scene.file.string(), i, key, what));
  };
  for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
    if (!bag_of(scene.instruments[i])) continue;
    if (std::ranges::none_of(scene.organs, cuttable_of))
      wrong(i, "kind",
            "found a bag, expected an organ with \"cuttable\": it keeps what is cut off");
    if (haptic_of(scene.instruments[i]))
      wrong(i, "haptic", "found for a bag, expected none: hands don't feel one");
  }
  if (!mistakes.messages.empty()) return std::unexpected(mistakes);
  return {};
}

Result<void> start_bags(World& world) {
  const Pool<InstrumentBody>& tools = world.all<InstrumentBody>();
  for (std::size_t i = 0; i < tools.size(); ++i)
    if (bag_of(tools[i].description))
      // It comes in closed, and no mouth closes by that.
      world.all<Bag>().add(tools.owner(i), {.closed = tools[i].jaw.at(0.0).x() < kMouthCloses});
  return {};
}

/// The pieces of an organ that nothing holds and that lie in the sack: the vertices of each.
std::vector<std::vector<int>> pieces_in_sack(const World& world, Entity organ,
                                             const BagDescription& bag,
                                             const InstrumentState& state) {
  const OrganLeft* left = world.find<OrganLeft>(organ);
  if (!left || left->pieces.empty() || world.find<OrganState>(organ)->frozen) return {};
  const Pose& pose = pose_of(world, organ);
  const std::vector<Vec3f>& now = world.find<OrganState>(organ)->positions;
  std::vector<std::vector<int>> pieces;
  for (std::size_t v = 0; v < left->pieces.size(); ++v) {
    const auto piece = static_cast<std::size_t>(left->pieces[v]);
    if (piece >= pieces.size()) pieces.resize(piece + 1);
    pieces[piece].push_back(static_cast<int>(v));
  }
  const auto is_out = [&](const std::vector<int>& vertices) {
    if (vertices.empty()) return true;
    const int piece = left->pieces[static_cast<std::size_t>(vertices.front())];
    if (loose_number(*left, piece) < 0) return true;
    const auto inside = std::ranges::count_if(vertices, [&](int v) {
      return in_sack(bag, state, pose.to_world(now[static_cast<std::size_t>(v)].cast<double>()));
    });
    return static_cast<double>(inside) < kInSack * static_cast<double>(vertices.size());
  };
  std::erase_if(pieces, is_out);
  return pieces;
}

/// Of these vertices some that lie far from each other at rest.
std::vector<int> spread_vertices(const std::vector<int>& vertices, const std::vector<Vec3>& rest,
                                 double apart) {
  std::vector<int> chosen;
  std::vector<double> away(vertices.size(), std::numeric_limits<double>::infinity());
  while (chosen.size() < kMostHolds) {
    const auto farthest = static_cast<std::size_t>(std::ranges::max_element(away) - away.begin());
    if (away[farthest] < apart) break;
    chosen.push_back(vertices[farthest]);
    const Vec3& place = rest[static_cast<std::size_t>(chosen.back())];
    for (std::size_t k = 0; k < vertices.size(); ++k)
      away[k] = std::min(away[k], (rest[static_cast<std::size_t>(vertices[k])] - place).norm());
  }
  return chosen;
}

/// A place of the surface at each of these vertices, which it has.
std::vector<SurfacePoint> points_at(const std::vector<int>& vertices,
                                    const TriangleSurface& surface) {
  std::vector<SurfacePoint> points(vertices.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c) {
      const auto at = std::ranges::find(vertices, surface.triangles[t][c]);
      if (at == vertices.end()) continue;
      points[static_cast<std::size_t>(at - vertices.begin())] = {
          static_cast<int>(t), Vec3::Unit(static_cast<Eigen::Index>(c))};
    }
  return points;
}

/// Adds holds of a piece, where it is now, to what the bag keeps.
void keep_piece(const World& world, const std::vector<int>& vertices, Grasp& grasp) {
  const OrganModel& model = *world.find<OrganBody>(grasp.organ)->model;
  const TissueContact& tissue = *world.find<OrganTouch>(grasp.organ)->solver;
  const double apart = kHoldsApart * model.finest_spacing;
  const std::vector<int> chosen = spread_vertices(vertices, model.surface.vertices, apart);
  const std::vector<SurfacePoint> points = points_at(chosen, model.surface);
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const auto vertex = static_cast<std::size_t>(chosen[k]);
    ContactCell cell;
    cell.held = true;
    cell.position = model.surface.vertices[vertex];
    cell.normal =
        corner_mean(model.rest_normals, model.surface, points[k]).cast<double>().normalized();
    cell.area = 0.25 * std::numbers::pi * apart * apart;
    cell.displacement =
        world.find<OrganState>(grasp.organ)->positions[vertex].cast<double>() - cell.position;
    if (!tissue.touchable(cell.position)) continue;
    grasp.cells.push_back(cell);
    grasp.points.push_back(points[k]);
  }
}

/// Of the organ of which most pieces lie in the sack; how many.
std::size_t keep_pieces(World& world, Entity instrument) {
  const BagDescription& bag = *bag_of(world.find<InstrumentBody>(instrument)->description);
  const InstrumentState& state = *world.find<InstrumentState>(instrument);
  Entity most;
  std::vector<std::vector<int>> pieces;
  const Pool<OrganCut>& cuts = world.all<OrganCut>();
  for (std::size_t c = 0; c < cuts.size(); ++c) {
    auto found = pieces_in_sack(world, cuts.owner(c), bag, state);
    if (found.size() <= pieces.size()) continue;
    pieces = std::move(found);
    most = cuts.owner(c);
  }
  if (pieces.empty()) return 0;
  Grasp grasp;
  grasp.organ = most;
  grasp.tip_at_start = state.tip;
  grasp.organ_at_start = pose_of(world, most).position;
  for (const std::vector<int>& vertices : pieces) keep_piece(world, vertices, grasp);
  if (grasp.cells.empty()) return 0;
  world.find<InstrumentContact>(instrument)->grasp = std::move(grasp);
  return pieces.size();
}

std::vector<ReportSection> bags_report(const World& world) {
  const Pool<Bag>& bags = world.all<Bag>();
  if (bags.size() == 0) return {};
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (std::size_t b = 0; b < bags.size(); ++b) {
    const Entity instrument = bags.owner(b);
    const bool keeps = world.find<InstrumentContact>(instrument)->grasp.has_value();
    list.push_back({{"instrument", world.find<InstrumentBody>(instrument)->description.name},
                    {"closed", bags[b].closed},
                    {"kept_pieces", bags[b].kept},
                    {"keeps_now", keeps}});
  }
  return {report_section("bags", list)};
}

}  // namespace

bool in_sack(const BagDescription& bag, const InstrumentState& state, const Vec3& place) {
  const double radius = 0.5 * bag.mouth;
  const Vec3& along = state.shaft_direction;
  const Vec3& down = state.side_direction;
  const Vec3 from = place - (state.tip - radius * along);
  const double below = from.dot(down);
  if (below < 0.0) return false;
  return Vec3(from.dot(along) / radius, from.dot(along.cross(down)) / radius, below / bag.depth)
             .squaredNorm() <= 1.0;
}

void close_bags(World& world, const FrameContext& context) {
  Pool<Bag>& bags = world.all<Bag>();
  for (std::size_t b = 0; b < bags.size(); ++b) {
    const Entity instrument = bags.owner(b);
    const bool was_closed = bags[b].closed;
    bags[b].closed = world.find<InstrumentState>(instrument)->jaw < kMouthCloses;
    if (!bags[b].closed) world.find<InstrumentContact>(instrument)->grasp.reset();
    if (!bags[b].closed || was_closed) continue;
    bags[b].kept = keep_pieces(world, instrument);
    if (bags[b].kept == 0) context.report->raise(kBagEmpty);
  }
}

Feature bag_feature() {
  return {.name = "bag",
          .keys = bag_keys(),
          .check = check_bags,
          .start = start_bags,
          .states = {state_type<Bag>()},
          .stages = {{.name = "close bags",
                      .reads = {"tool poses", "organ poses", "surfaces", "cuts"},
                      .writes = {"bags"},
                      .changes = {"bags", "tool forces"},
                      .needed = [](const World& world) { return world.has<Bag>(); },
                      .run = close_bags}},
          .flags = {kBagEmpty},
          .report = bags_report};
}

}  // namespace viscera
