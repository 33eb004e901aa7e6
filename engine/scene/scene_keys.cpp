#include "engine/scene/scene_keys.h"

#include "engine/scene/common_keys.h"
#include "engine/scene/material_keys.h"

namespace viscera {
namespace {

constexpr double kGreatestSeed =
    9007199254740991.0;  // 2^53 - 1: what every JSON reader keeps exactly
constexpr double kShortestShaft_mm = 1.0;

KeySpec file_unit(std::string beside) {
  return text("unit", "Length that one unit of the file stands for.")
      .needed()
      .one_of({"mm", "cm", "m"})
      .only_beside(std::move(beside));
}

// --- organs -------------------------------------------------------------------------------------

ObjectSpec wrap() {
  return {"How a surface is wrapped that is open, of several patches, thin or crossing itself.",
          {number("voxel_mm", "Of the grid on which distances from the surface are kept.")
               .needed()
               .between(0.05, 50),
           number("close_mm",
                  "Gaps up to this width are closed everywhere; two voxels where it is left out "
                  "or less.")
               .between(0, 200)},
          {},
          {}};
}

ObjectSpec geometry() {
  ObjectSpec spec;
  spec.description = "Either a generated organ (recipe) or a closed surface from a file (file).";
  spec.exactly_one_of = {"recipe", "file"};
  spec.keys = {
      text("recipe",
           "A recipe of assets/organs by its file's name, or a built-in body: sphere (centre at "
           "the origin), hemisphere (flat base at z = 0, pole up), block (centre at the origin).")
          .known_as("recipe"),
      integer("seed", "Picks one of the recipe's shapes.")
          .between(0, kGreatestSeed)
          .otherwise(1)
          .only_beside("recipe"),
      integer("triangles", "Exact number of triangles of the drawn surface, in place of edge_mm.")
          .between(20, 2000000)
          .only_beside("recipe"),
      number("radius_mm", "Of a sphere or hemisphere.")
          .needed()
          .between(0.1, 1000)
          .only_where("recipe", {"sphere", "hemisphere"}),
      vector("size_mm", "Of a block, along x, y and z.")
          .needed()
          .between(0.1, 2000)
          .only_where("recipe", {"block"}),
      number("scale", "Multiplies the recipe's own size.")
          .between(0.01, 100)
          .otherwise(1.0)
          .only_beside("recipe"),
      file_key("file",
               "A closed surface: OBJ, STL, PLY, glTF or GLB. Sought in the scene's folder, in the "
               "folders of --assets and their subfolders, and in the project's assets."),
      file_unit("file"),
      boolean("recentre", "Move the centre of the surface's bounding box to the origin.")
          .otherwise(false)
          .only_beside("file"),
      object("wrap",
             "Put a closed surface around the file's, which may be open, of several patches, thin "
             "or crossing itself. The distance between the two is reported.",
             wrap())
          .only_beside("file"),
      number("edge_mm",
             "Wanted triangle edge of the drawn surface; the recipe's or file's own "
             "where it is left out, two voxels where the file is wrapped.")
          .between(0.05, 100),
  };
  spec.checks = {{{"edge_mm", "triangles"},
                  [](const Json&) -> Finding {
                    return {{"triangles", "found it beside edge_mm, expected one of the two"}};
                  },
                  {{"not", {{"required", {"edge_mm", "triangles"}}}}}},
                 {{"triangles"},
                  [](const Json& values) -> Finding {
                    if (values["triangles"].get<int>() % 2 == 0) return {};
                    return {{"triangles", "found " + values["triangles"].dump() +
                                              ", expected an even number, as every closed surface "
                                              "of triangles has"}};
                  },
                  {{"properties", {{"triangles", {{"multipleOf", 2}}}}}}}};
  return spec;
}

ObjectSpec region() {
  const ObjectSpec half_space{"All that lies behind a plane.",
                              {position("point_mm", "A point of the plane.").needed(),
                               vector("normal", "Points out of the region; of any length but zero.")
                                   .needed()
                                   .between(-1e6, 1e6)},
                              {},
                              {has_direction("normal")}};
  return {"A part of space in the organ's own frame, before its pose.",
          {object("half_space", "All that lies behind a plane.", half_space),
           object("sphere", "A ball.", ball()),
           object("box", "An axis-aligned box.", box("An axis-aligned box."))},
          {"half_space", "sphere", "box"},
          {}};
}

ObjectSpec part() {
  const ObjectSpec recipe{
      "A body that a recipe makes.",
      {text("name", "A recipe of assets/organs by its file's name.").needed().known_as("body"),
       integer("seed", "Picks one of the recipe's shapes.").between(0, kGreatestSeed).otherwise(1)},
      {},
      {}};
  const ObjectSpec labels{
      "The voxels of a label, as a segmentation program writes them.",
      {volume_key("file",
                  "A label map: .nii, .nii.gz, .nrrd or .nhdr, with x to the patient's left, y to "
                  "the head and z to the front of the organ's frame; sought as surfaces are.")
           .needed(),
       integer("label", "Number of the voxels that are meant.").needed().between(1, 2147483647)},
      {},
      {}};
  const ObjectSpec field{
      "Young's modulus voxel by voxel, as elastography gives it; it must cover the organ.",
      {volume_key("file", "Whole numbers, 0 where the modulus isn't known; as a label map.")
           .needed(),
       number("kPa_per_unit", "Modulus that 1 stands for.").needed().between(1e-6, 1e6)},
      {},
      {}};
  ObjectSpec spec;
  spec.description =
      "Tissue of an organ that is stiffer, softer, denser or lighter than the rest of it; in the "
      "organ's own frame.";
  spec.exactly_one_of = {"capsule_mm", "region", "recipe", "labels", "field"};
  spec.keys = {
      number("capsule_mm", "A layer so thick under all of the organ's surface.").between(0.01, 50),
      object("region", "A part of space.", region()),
      object("recipe", "A body of assets/organs.", recipe),
      object("labels", "A label of a label map.", labels),
      object("field", "A map of moduli.", field),
      number("youngs_modulus_kPa", "Its modulus; Poisson's ratio is the organ's.")
          .between(0.001, 1e6),
      number("density_kg_m3", "Its density.").between(1, 20000),
      object("fibres", "Its fibres.", fibres())};
  spec.checks = {
      {{"field", "youngs_modulus_kPa"},
       [](const Json&) -> Finding {
         return {{"youngs_modulus_kPa", "found it beside field, expected one of the two"}};
       },
       {{"not", {{"required", {"field", "youngs_modulus_kPa"}}}}}},
      {{},
       [](const Json& values) -> Finding {
         if (values.contains("field") || values.contains("youngs_modulus_kPa") ||
             values.contains("density_kg_m3") || values.contains("fibres"))
           return {};
         return {{"youngs_modulus_kPa",
                  "found neither it nor density_kg_m3 nor fibres, expected at least one of them"}};
       },
       {{"anyOf",
         {{{"required", {"field"}}},
          {{"required", {"youngs_modulus_kPa"}}},
          {{"required", {"density_kg_m3"}}},
          {{"required", {"fibres"}}}}}}}};
  return spec;
}

ObjectSpec resolution() {
  return {"Where the nodes of the organ lie.",
          {number("spacing_mm", "Greatest node spacing.").between(0.1, 100).otherwise(8.0),
           number("finest_spacing_mm", "Node spacing in the fine part of the surface.")
               .between(0.1, 100)
               .otherwise(3.0),
           list("fine",
                "Regions whose union holds the fine part of the surface, wherever tools come. Left "
                "out: bricks of 20 mm that paths and links come near, so that a key frame moved "
                "far enough means another preparation.",
                region())
               .items(0, 100)
               .otherwise(Json::array()),
           number("gradient", "Growth of the spacing per distance from there.")
               .between(0.01, 2)
               .otherwise(0.25)},
          {},
          {{{"spacing_mm", "finest_spacing_mm"},
            [](const Json& values) -> Finding {
              if (values["finest_spacing_mm"] <= values["spacing_mm"]) return {};
              return {{"finest_spacing_mm", "found " + values["finest_spacing_mm"].dump() +
                                                ", expected at most spacing_mm, which is " +
                                                values["spacing_mm"].dump()}};
            },
            nullptr}}};
}

ObjectSpec pose() {
  return {"Where the organ's frame stands in the world.",
          {position("position_mm", "Of the frame's origin.").otherwise({0, 0, 0}),
           vector("rotation_deg", "About the world's x, then y, then z axis, before the move.")
               .between(-360, 360)
               .otherwise({0, 0, 0})},
          {},
          {}};
}

ObjectSpec finite() {
  return {
      "Tissue at finite strain.",
      {boolean("quasi_static", "true: every frame goes to equilibrium, without mass and viscosity.")
           .otherwise(false),
       number("viscous_time_ms",
              "Viscosity over shear modulus: what keeps tissue from swinging for long.")
           .between(0, 1000)
           .otherwise(20),
       integer("iterations",
               "Quasi-Newton steps a frame; report.json says what a further one would gain.")
           .between(1, 100)
           .otherwise(2)},
      {},
      {}};
}

/// What features add to one kind of object.
void add_part(ObjectSpec& spec, const std::vector<FeatureKeys>& features,
              FeatureKeys::Part FeatureKeys::*part) {
  for (const FeatureKeys& feature : features) {
    const FeatureKeys::Part& added = feature.*part;
    spec.keys.insert(spec.keys.end(), added.keys.begin(), added.keys.end());
    spec.checks.insert(spec.checks.end(), added.checks.begin(), added.checks.end());
  }
}

ObjectSpec organ(const std::vector<FeatureKeys>& features) {
  ObjectSpec spec;
  spec.description = "A body of tissue.";
  spec.keys = {
      name_key("Its name in reports, labels and --set; unique among organs."),
      object("geometry", "Its surface.", geometry()).needed(),
      text("tissue", "A tissue of assets/tissues.json.").needed().known_as("tissue"),
      number("youngs_modulus_kPa", "In place of the tissue's.").between(0.001, 1e6),
      number("poisson_ratio", "In place of the tissue's.").from_to_below(0, 0.5),
      object("material", "How held tools feel it beyond small, slow strains.", material_keys())
          .otherwise(Json::object()),
      list("parts",
           "What within it has a modulus, a density or fibres of its own: a capsule, a tumour, a "
           "vessel's "
           "wall. Later ones lie over earlier ones. What is finer than the nodes counts by its "
           "share of the tissue about it.",
           part())
          .items(0, 100)
          .otherwise(Json::array()),
      object("pose", "Where it stands in the world.", pose()).otherwise(Json::object()),
      list("fixed",
           "Regions whose union holds the surface that doesn't move; a deformable organ "
           "needs at least one, unless it is free.",
           region())
          .items(0, 100)
          .otherwise(Json::array()),
      boolean("free",
              "Nothing holds it: under gravity it falls on what lies below it, slides there and "
              "comes to rest. It needs contact between organs, and answers at finite strain.")
          .otherwise(false),
      text("formulation", "How the elastic response is discretised.")
          .known_as("formulation")
          .otherwise("galerkin"),
      text("response",
           "What it answers forces with: a compliance computed before the run (linear; also "
           "called global), its energy at finite strain (finite), which carries being lifted and "
           "bent far and swings back when it is let go, or hives about whatever touches it "
           "(local), with nothing to prepare. auto: finite where a jaw closes on the organ or a "
           "hand holds a jaw, where current passes, where a tip's path goes deeper than 9 mm below "
           "the surface at rest, under gravity that changes, where some of its holds move, and "
           "where the organ's material isn't linear or relaxes, unless the organ has what finite "
           "strain doesn't know yet (stvk, a formulation but galerkin, storage in half precision); "
           "else linear.")
          .one_of({"auto", "linear", "finite", "local", "global"})
          .otherwise("auto"),
      object("finite", "How it moves where its response is finite.", finite())
          .otherwise(Json::object()),
      object("resolution", "Where its nodes lie.", resolution()).otherwise(Json::object()),
      text("displacement_storage",
           "Precision of the numbers that move the drawn surface under forces: half takes about "
           "half "
           "the memory, with an error that report.json gives. What gives the forces stays single.")
          .one_of({"single", "half"})
          .otherwise("single"),
      boolean("deformable", "false: scenery that nothing touches or moves.").otherwise(true),
  };
  spec.checks = {
      {{"deformable", "fixed", "free"},
       [](const Json& values) -> Finding {
         if (!values["deformable"].get<bool>() || !values["fixed"].empty() ||
             values["free"].get<bool>())
           return {};
         return {{"fixed",
                  "found no region, expected at least one: a body that nothing holds "
                  "would drift away (or \"deformable\": false, or \"free\": true)"}};
       },
       {{"if",
         {{"not",
           {{"anyOf",
             {{{"properties", {{"deformable", {{"const", false}}}}}, {"required", {"deformable"}}},
              {{"properties", {{"free", {{"const", true}}}}}, {"required", {"free"}}}}}}}}},
        {"then", {{"properties", {{"fixed", {{"minItems", 1}}}}}, {"required", {"fixed"}}}}}}};
  spec.checks.push_back({{"parts", "response"},
                         [](const Json& values) -> Finding {
                           if (values["parts"].empty() || values["response"] != "local") return {};
                           return {{"parts",
                                    "found some with response local, expected none, or another "
                                    "response: hives alone know one modulus"}};
                         },
                         nullptr});
  spec.checks.push_back({{"parts", "formulation"},
                         [](const Json& values) -> Finding {
                           const std::string formulation = values["formulation"];
                           if (values["parts"].empty() || formulation.starts_with("galerkin"))
                             return {};
                           return {
                               {"parts", "found some with formulation " + formulation +
                                             ", expected none, or galerkin or galerkin_quadratic"}};
                         },
                         nullptr});
  spec.checks.push_back(
      {{"material", "response"},
       [](const Json& values) -> Finding {
         if (!values["material"].contains("fibres") || values["response"] != "local") return {};
         return {{"material/fibres",
                  "found some with response local, expected none, or another response: hives know "
                  "no direction"}};
       },
       nullptr});
  spec.checks.push_back(
      {{"material", "formulation"},
       [](const Json& values) -> Finding {
         const std::string formulation = values["formulation"];
         if (!values["material"].contains("fibres") || formulation.starts_with("galerkin"))
           return {};
         return {{"material/fibres", "found some with formulation " + formulation +
                                         ", expected none, or galerkin or galerkin_quadratic"}};
       },
       nullptr});
  add_part(spec, features, &FeatureKeys::organ);
  return spec;
}

// --- instruments --------------------------------------------------------------------------------

ObjectSpec tip() {
  return {
      "The end that touches tissue.",
      {text("shape", "point; sphere and capsule about the tip's position; mesh from a file.")
           .one_of({"point", "sphere", "capsule", "mesh"})
           .otherwise("sphere"),
       number("radius_mm", "Of the sphere or capsule.")
           .between(0.05, 50)
           .otherwise(1.5)
           .only_where("shape", {"sphere", "capsule"}),
       number("length_mm", "Of the capsule's axis, from the tip's position back along the shaft.")
           .needed()
           .between(0.05, 200)
           .only_where("shape", {"capsule"}),
       file_key("file", "A closed surface, shaft along +z, tip at the origin.")
           .needed()
           .only_where("shape", {"mesh"}),
       file_unit("file")},
      {},
      {}};
}

// Which mistakes a path has for its instrument: the shaft needs a direction, only some kinds
// conduct, and only sealing jaws may have a knife.
Finding path_fits_instrument(const Json& instrument) {
  const Json& path = instrument["path"];
  for (std::size_t i = 0; i < path.size(); ++i) {
    const std::string here = "path/" + std::to_string(i);
    if (distance(path[i]["tip_mm"], instrument["trocar_mm"]) < kShortestShaft_mm)
      return {{here + "/tip_mm", "found " + path[i]["tip_mm"].dump() +
                                     ", expected a point at least 1 mm from trocar_mm"}};
    const bool conducts = instrument["kind"] == "hook" || instrument["kind"] == "spatula" ||
                          instrument["kind"] == "scissors" || instrument.contains("bipolar");
    if (!conducts && path[i]["power_W"] > 0)
      return {{here + "/power_W", "found " + path[i]["power_W"].dump() + " for a " +
                                      instrument["kind"].get<std::string>() +
                                      ", expected 0: only a hook, a spatula, scissors or a "
                                      "grasper with \"bipolar\" conducts"}};
    const bool has_knife =
        instrument.contains("bipolar") && instrument["bipolar"].contains("blade_mm");
    if (!has_knife && path[i]["blade"] == true)
      return {{here + "/blade",
               "found true, expected false: only a grasper whose \"bipolar\" has \"blade_mm\" has "
               "a knife between its jaws"}};
  }
  return {};
}

ObjectSpec instrument(const std::vector<FeatureKeys>& features) {
  const ObjectSpec key{
      "State at one time.",
      {time_key("When; ascending along the path."),
       position("tip_mm",
                "Where the tip is: the centre of its sphere, the end of a capsule's axis.")
           .needed(),
       number(
           "power_W",
           "Electrical power of a hook, a spatula, scissors or bipolar jaws; held until the next "
           "key.")
           .between(0, 400)
           .otherwise(0.0),
       number("jaw",
              "Opening of a grasper, of scissors, of a clip applier or of a bag's mouth: 0 closed, "
              "1 open.")
           .between(0, 1)
           .otherwise(1.0),
       boolean("blade",
               "The trigger of a knife between sealing jaws (bipolar, blade_mm): true sends it "
               "forward while they are closed, false back; held until the next key.")
           .otherwise(false)},
      {},
      {}};
  ObjectSpec spec;
  spec.description = "An instrument that enters through a trocar.";
  spec.keys = {
      name_key("Its name in forces.csv, reports and --set; unique among instruments."),
      text(
          "kind",
          "What it can do: press, hold, burn, cut, apply clips, or keep what was cut off in a bag.")
          .needed()
          .one_of({"probe", "grasper", "hook", "spatula", "scalpel", "scissors", "clip_applier",
                   "bag"}),
      object("tip", "The end that touches tissue.", tip()).otherwise(Json::object()),
      position("trocar_mm", "Point of the wall that its shaft pivots about.").needed(),
      number("shaft_radius_mm", "Of the shaft.").between(0.1, 25).otherwise(2.5),
      number("roll_deg",
             "About the shaft: at 0 a hook bends, jaws open, and a spatula faces, downwards.")
          .between(-360, 360)
          .otherwise(0.0),
      number("grip_limit_N", "Greatest force that the closed jaw holds. Left out: 6.")
          .between(0, 100)
          .only_where("kind", {"grasper"}),
      number("grip_radius_mm", "Radius of the patch that the closed jaw holds.")
          .between(0.1, 50)
          .otherwise(4.0)
          .only_where("kind", {"grasper"}),
      number("friction",
             "Coulomb's coefficient between its tip and tissue: tissue clings to the tip until the "
             "drag passes this share of the pressing force. 0 slides freely; from some 10 on, what "
             "the tip presses sticks to it.")
          .between(0, 1000)
          .otherwise(0.0),
      list("path", "Key frames; position and jaw are interpolated, monotone and smooth.", key)
          .needed()
          .items(1, 100000)
          .ascending_by("time_s"),
  };
  spec.checks = {{{"kind", "trocar_mm", "path"}, path_fits_instrument, nullptr}};
  add_part(spec, features, &FeatureKeys::instrument);
  return spec;
}

// --- picture ------------------------------------------------------------------------------------

ObjectSpec camera() {
  const ObjectSpec key{
      "Pose at one time.",
      {time_key("When; ascending along the path."),
       position("tip_mm", "Where the lens is.").needed(),
       position("target_mm", "A point on the shaft's axis beyond the lens.").needed(),
       number("roll_deg", "About the shaft's axis.").between(-360, 360).otherwise(0.0)},
      {},
      {{{"tip_mm", "target_mm"},
        [](const Json& values) -> Finding {
          if (distance(values["tip_mm"], values["target_mm"]) >= kShortestShaft_mm) return {};
          return {{"target_mm", "found " + values["target_mm"].dump() +
                                    ", expected a point at least 1 mm from tip_mm"}};
        },
        nullptr}}};
  return {"The endoscope.",
          {number("optics_deg", "Angle by which the view looks down from the shaft's axis.")
               .one_of({0, 30})
               .otherwise(0),
           number("field_of_view_deg", "Vertical.").between(5, 150).otherwise(70.0),
           boolean("round_mask", "Black outside the round picture of a real endoscope.")
               .otherwise(true),
           list("path", "Key frames.", key).needed().items(1, 100000).ascending_by("time_s")},
          {},
          {}};
}

ObjectSpec light() {
  return {
      "The light at the lens.",
      {number("intensity", "Relative to a light that exposes 10 cm well.")
           .between(0, 100)
           .otherwise(1.0),
       number("colour_temperature_K", "Of a black body.").between(1000, 20000).otherwise(5600.0)},
      {},
      {}};
}

ObjectSpec scene(const std::vector<FeatureKeys>& features) {
  ObjectSpec spec;
  spec.description =
      "A laparoscopic scene. The world's z axis points up, against gravity where the table is "
      "level; "
      "quantities carry their unit in the key. Comments (// and /* */) are allowed.";
  spec.keys = {
      text("$schema", "Path of this schema, for editors."),
      integer("version", "Of the format.").needed().one_of({1}),
      name_key("Names the run in reports."),
      text("title", "One line for people.").otherwise(""),
      number("duration_s", "Simulated time.").between(0.001, kLongest_s).otherwise(10.0),
      integer("steps_per_s",
              "Into how many steps a second of it is cut. Fewer take less time, and err more.")
          .one_of({30, 60, 120, 240})
          .otherwise(60),
      integer("seed", "Of everything random.").between(0, kGreatestSeed).otherwise(1),
      list("organs", "Bodies of tissue.", organ(features)).needed().items(0, 200).unique_by("name"),
      list("instruments", "What the surgeon holds.", instrument(features))
          .items(0, 20)
          .unique_by("name")
          .otherwise(Json::array()),
      object("camera", "The endoscope; without one, nothing can be rendered.", camera()),
      object("light", "The light at the lens.", light()).otherwise(Json::object()),
  };
  add_part(spec, features, &FeatureKeys::scene);
  return spec;
}

}  // namespace

ObjectSpec scene_keys(const std::vector<FeatureKeys>& features) {
  return scene(features);
}

}  // namespace viscera
