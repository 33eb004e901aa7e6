// Bipolar current: between two jaws, through the tissue that they squeeze.
//
// Jaws are wide beside what lies between them, so current goes straight from one to the other, in
// columns beside each other: of a column of rest length L and area A, squeezed to the gap g between
// them, its volume staying, the resistance is (g / L)^2 / A times the integral of 1/sigma over L.
// What leaves at the jaws' rims and comes in from beside is left out. A column's end lies on the
// surface, within a voxel: of what is beside it the share that is tissue counts.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "kernels/heat/electrode.h"

namespace viscera {

/// Tissue between two places of the jaws; rest frame.
struct JawColumn {
  Vec3 upper = Vec3::Zero(), lower = Vec3::Zero();  ///< [m]
  double area = 0.0;                                ///< [m2]
};

/// Share of the volume between whose proteins have coagulated.
double coagulated_between(const Bioheat& heat, std::span<const JawColumn> columns);

/// Of a bipolar generator: it holds the power until its voltage or current ends. That of vessel
/// sealers is some 180 V and 4 A. [R]
struct BipolarGenerator {
  double most_voltage = 180.0;  ///< root mean square [V]
  double most_current = 4.0;    ///< [A]
};

/// The metal of both jaws together that tissue warms: plates .3 mm thick on an insulator, 10 x 4 mm
/// of each. [R]
Electrode electrode_of_jaws();

class JawCurrent {
 public:
  /// As the tissue is now; `gap`: between the jaws [m]. What is thinner touches but one of them.
  JawCurrent(Bioheat& heat, std::span<const JawColumn> columns, double gap);

  /// Of all columns together; infinite: no tissue is between [Ohm].
  double resistance() const;
  /// Current during the step of dt [s] that follows, of a generator set to `power` [W]: heats the
  /// tissue (heat.step then spreads it).
  CurrentReport pass(Bioheat& heat, const BipolarGenerator& generator, double power, double dt);

 private:
  struct Part {
    HeatBrick* brick;
    int voxel;
    double resistance;  ///< [Ohm]
  };
  struct Column {
    std::size_t first = 0, last = 0;  // of the parts
    double resistance = 0.0;
  };
  std::vector<Part> parts_;
  std::vector<Column> columns_;
};

}  // namespace viscera
