#include "engine/features/parting/parting_keys.h"

#include "engine/scene/to_si.h"

namespace viscera {

const CuttableDescription* cuttable_of(const OrganDescription& organ) {
  return organ.extras.find<CuttableDescription>();
}

const WallDescription* wall_of(const OrganDescription& organ) {
  return organ.extras.find<WallDescription>();
}

const BladeDescription* blade_of(const InstrumentDescription& instrument) {
  return instrument.extras.find<BladeDescription>();
}

double bore_of(const InstrumentDescription& instrument) {
  const BoreDescription* bore = instrument.extras.find<BoreDescription>();
  return bore ? bore->bore : BoreDescription().bore;
}

FeatureKeys parting_keys() {
  FeatureKeys keys;
  keys.organ.keys = {
      object("cuttable",
             "Scalpels and scissors may cut it, and hooks and spatulas with current. It is then at "
             "finite strain. Left out: nothing cuts it, and blades press it as a probe does.",
             {"How cuts are followed.",
              {number("voxel_mm",
                      "Edge of the voxels that know what is gone. No cut is thinner "
                      "than two of them.")
                   .between(0.1, 1)
                   .otherwise(0.25),
               boolean("tears",
                       "Whether it tears where it is pulled beyond its tissue's "
                       "ultimate_strain, which that must have.")
                   .otherwise(false)},
              {},
              {}}),
      number("wall_mm",
             "Thickness of a hollow organ's wall; here it is solid. report.json counts the places "
             "where heat or blades have gone through it (parting, perforations). Left out: nothing "
             "is known of a wall, and none are counted.")
          .between(0.2, 50)};
  keys.organ.read = [](const Json& organ, Extras& extras) {
    if (organ.contains("wall_mm")) extras.set(WallDescription{from_milli(organ["wall_mm"])});
    if (organ.contains("cuttable"))
      extras.set(CuttableDescription{from_milli(organ["cuttable"]["voxel_mm"]),
                                     organ["cuttable"]["tears"].get<bool>()});
  };
  keys.instrument.keys = {
      number("blade_mm",
             "Length of a scalpel's edge or of scissors' blades, from the tip back along the "
             "shaft.")
          .between(1, 60)
          .otherwise(10.0)
          .only_where("kind", {"scalpel", "scissors"}),
      number("blade_thickness_mm", "Of a scalpel's or scissors' blade; as wide is its cut.")
          .between(0.1, 2)
          .otherwise(0.4)
          .only_where("kind", {"scalpel", "scissors"}),
      number(
          "bore_mm",
          "Of the trocar. A piece that was cut off comes out through it in the jaws, and is gone "
          "from the scene, where it is no wider than this; in a bag up to three times as wide. "
          "12 mm is the widest common one.")
          .between(3, 60)
          .otherwise(12.0)
          .only_where("kind", {"grasper", "bag"})};
  keys.instrument.read = [](const Json& instrument, Extras& extras) {
    if (instrument.contains("bore_mm"))
      extras.set(BoreDescription{from_milli(instrument["bore_mm"])});
    if (!instrument.contains("blade_mm")) return;
    extras.set(BladeDescription{from_milli(instrument["blade_mm"]),
                                from_milli(instrument["blade_thickness_mm"])});
  };
  return keys;
}

}  // namespace viscera
