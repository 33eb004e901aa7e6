// Gravity in the patient's frame as the table tilts, and how far that moves organs.
#pragma once

#include "engine/features/gravity/gravity_keys.h"
#include "engine/simulation/feature.h"
#include "engine/simulation/key_frames.h"

namespace viscera {

/// Organs have their rest shapes under the gravity in which they were imaged, so that what counts
/// is the change since. All vectors in the world's frame, which turns with the table.
class Gravity {
 public:
  explicit Gravity(const GravityDescription& description);

  /// Gravity at `time` [s] less that of the rest shapes [m/s2]; exactly zero where they are the
  /// same.
  Vec3 change_at(double time) const;
  Vec3 at(double time) const;  ///< all of it, which a body feels that nothing holds [m/s2]

 private:
  double acceleration_;
  Vec3 rest_direction_;
  KeyFrames table_;  // head up, left side down, - [rad]
};

/// The scene's, where it changes.
struct TableGravity {
  static constexpr bool kConstant = true;
  Gravity gravity;
};

/// How gravity has changed for an organ since its rest shape; of one that nothing holds, all of it.
/// A piece that was cut off has the rest of it as a weight of its own (engine/organ/cut_organ.h).
struct OrganSag {
  static constexpr std::string_view kName = "sagging organs";
  Vec3 change = Vec3::Zero();  ///< organ frame [m/s2]
  static constexpr auto fields() { return std::tuple(field("change", &OrganSag::change)); }
};

/// Adds the displacements of the places of a model's surface under this change of gravity in its
/// own frame [m]; nothing where it doesn't sag.                                           (3
/// places)
void add_sag(const OrganModel& model, const Vec3& change, std::vector<float>& places);

/// The farthest that gravity moves a place of the model within `duration` [s], nothing else
/// touching it [m].
double greatest_sag(const OrganModel& model, const Pose& pose, const Gravity& gravity,
                    double duration);

Feature gravity_feature();

}  // namespace viscera
