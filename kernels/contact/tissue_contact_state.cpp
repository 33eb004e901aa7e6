#include "kernels/contact/tissue_contact_state.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "kernels/base/finite.h"

namespace viscera {

bool is_sound(const TissueContactState& state, std::size_t touchable, std::size_t anchors) {
  const std::size_t cells = state.places.size(), unknowns = state.unknowns();
  const auto is_place = [](const TissueContactState::Place& place) {
    return place.position.allFinite() && place.normal.allFinite() && std::isfinite(place.area) &&
           place.area > 0.0 && std::isfinite(place.bell) && place.bell >= 0.0f;
  };
  const auto is_way = [](const TissueContactState::Way& way) {
    return way.direction.allFinite() && std::isfinite(way.friction) && way.friction >= 0.0;
  };
  const std::vector<int>& touched = state.response.touched;
  const auto order = static_cast<Eigen::Index>(unknowns);
  return std::ranges::all_of(state.places, is_place) && std::ranges::all_of(state.ways, is_way) &&
         (state.ways.empty() || cells == 0 || state.ways.size() == cells) &&
         state.amounts.allFinite() && state.lifted.allFinite() &&
         (state.lifted.size() == 0 ||
          (state.lifted.rows() == order && state.lifted.cols() == order &&
           state.amounts.size() == order)) &&
         !first_stray(state.forces) && !first_stray(state.displacements) &&
         !first_stray(state.remembered) &&
         (state.forces.empty() || cells == 0 || state.forces.size() == cells) &&
         !first_stray(state.response.loads) && state.response.loads.size() == touched.size() &&
         std::ranges::adjacent_find(touched, std::ranges::greater_equal()) == touched.end() &&
         (touched.empty() ||
          (touched.front() >= 0 && static_cast<std::size_t>(touched.back()) < touchable)) &&
         state.columns_built <= cells - anchors && state.stayed >= 0;
}

}  // namespace viscera
