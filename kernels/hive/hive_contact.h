// Contact on a body that hives alone answer for (LPAFF): nothing is prepared of it. Cells that lie
// together, as those of one tool, stand on a hive of their own; cells of two hives feel each other
// as on a half-space.
//
// Hives are built about where the cells are whenever these move, so that what a frame answers
// depends on that frame's cells and on nothing before.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kernels/contact/half_space.h"
#include "kernels/contact/tissue_contact.h"
#include "kernels/hive/hive.h"

namespace viscera {

class HiveContact final : public TissueContact {
 public:
  /// `surface` outlives it. The periphery is the half-space's, whatever `settings` say: it is the
  /// one that needs nothing prepared. Fails as Hive::create does.
  static Result<std::unique_ptr<HiveContact>> create(const WalkableSurface& surface,
                                                     HiveSettings settings);

  TissueAbilities abilities() const override { return {.springs = true}; }
  bool touchable(const Vec3&) const override { return true; }
  bool fits(const State& state) const override;

  void place_displacements(const ContactResponse& response,
                           std::vector<float>& displacements) override;
  void draw(std::span<const float> displacements, std::span<const ContactCell> cells,
            const ContactSolution& solution, std::vector<Vec3f>& positions) const override;

  /// Cells that stand on no hive, since none could be built there: a half-space answers for them.
  int without_hive() const { return without_hive_; }

 private:
  /// Cells that lie together.
  struct Cluster {
    SurfaceSpot centre;
    std::vector<int> cells;
    Hive* hive = nullptr;  // null: none could be built
  };

  HiveContact(const WalkableSurface& surface, const HiveSettings& settings, Hive first);

  void make_response() override;
  void drop_response() override;
  void spread_forces(std::span<const Vec3> forces, ContactResponse& response) override;
  NearField any_near_field() const override;
  void gather_clusters();
  Hive* find_hive(const SurfaceSpot& centre, std::vector<char>& taken);
  Hive* build_hive(const SurfaceSpot& centre, std::vector<char>& taken);

  const WalkableSurface& surface_;
  HiveSettings settings_;
  HalfSpace half_space_;
  std::vector<Hive> hives_;
  std::vector<char> stands_;  // each is built about its centre
  std::vector<Cluster> clusters_;
  int without_hive_ = 0;
};

}  // namespace viscera
