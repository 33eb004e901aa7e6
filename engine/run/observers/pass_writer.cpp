#include "engine/run/observers/pass_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

namespace viscera {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<std::pair<Pass, std::string_view>, 8> kNames = {{
    {Pass::kBeauty, "beauty"},
    {Pass::kClean, "clean"},
    {Pass::kScattered, "scattered"},
    {Pass::kTransmittance, "transmittance"},
    {Pass::kLightTransmittance, "light_transmittance"},
    {Pass::kDepth, "depth"},
    {Pass::kLabels, "labels"},
    {Pass::kTemperature, "temperature"},
}};

/// One line of the header's legend.
std::string_view legend_of(Pass pass) {
  switch (pass) {
    case Pass::kBeauty:
      return "beauty.R G B: what the lens sees, with smoke = clean * transmittance * "
             "light_transmittance + scattered, to half precision. Linear, sRGB primaries; 1: a "
             "white matte surface 10 cm before the lens, under light of intensity 1";
    case Pass::kClean:
      return "clean.R G B: the same without smoke";
    case Pass::kScattered:
      return "scattered.R G B: light that smoke sends to the lens, from the light guide and from "
             "the cavity's walls";
    case Pass::kTransmittance:
      return "transmittance: exp(-tau), tau the optical depth of smoke from the surface to the "
             "lens; 1: none";
    case Pass::kLightTransmittance:
      return "light_transmittance: share of the guide's light that comes through smoke to the "
             "surface, exp(-(1 - albedo g) tau'), tau' the optical depth from the guide (beside "
             "the lens): what is scattered forward still arrives. Light that has bounced about "
             "the cavity is dimmed by the same factor";
    case Pass::kDepth:
      return "depth: distance along the view axis [m]; inf: nothing is seen within 2 m, or the "
             "pixel lies outside the round field of view";
    case Pass::kLabels:
      return "labels: which body a pixel shows, by the attribute `labels`";
    case Pass::kTemperature:
      return "temperature.surface: of what is seen [K]; of an organ that nothing warmed the "
             "cavity's, "
             "of instruments unknown (NaN). temperature.smoke: of the smoke between surface and "
             "lens, mean "
             "by mass [K]; the gas's where there is none, NaN outside the field of view";
  }
  return {};
}

void add_colour(ExrPicture& picture, const std::string& name, const std::vector<float>& rgb) {
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<float> values(rgb.size() / 3);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = rgb[3 * i + c];
    picture.channels.push_back({name + "." + "RGB"[c], std::move(values), true});
  }
}

void add_pass(ExrPicture& picture, Pass pass, const PassImages& images) {
  switch (pass) {
    case Pass::kBeauty:
      return add_colour(picture, "beauty", images.beauty);
    case Pass::kClean:
      return add_colour(picture, "clean", images.clean);
    case Pass::kScattered:
      return add_colour(picture, "scattered", images.scattered);
    case Pass::kTransmittance:
      picture.channels.push_back({"transmittance", images.transmittance, true});
      return;
    case Pass::kLightTransmittance:
      picture.channels.push_back({"light_transmittance", images.light_transmittance, true});
      return;
    case Pass::kDepth:
      picture.channels.push_back({"depth", images.depth});
      return;
    case Pass::kLabels:
      picture.channels.push_back({"labels", images.labels});
      return;
    case Pass::kTemperature:
      picture.channels.push_back({"temperature.surface", images.surface_temperature});
      picture.channels.push_back({"temperature.smoke", images.smoke_temperature});
      return;
  }
}

std::string label_table(const FrameView& view) {
  Json table = {{"0", "nothing"}};
  std::size_t label = 0;
  for (const OrganView& organ : view.organs) table[std::to_string(++label)] = organ.name;
  for (const InstrumentView& tool : view.instruments) table[std::to_string(++label)] = tool.name;
  for (const BedView& bed : view.beds) table[std::to_string(++label)] = bed.name;
  return table.dump();
}

std::string camera_text(const CameraView& camera) {
  const auto vector = [](const Vec3& v) { return Json{v.x(), v.y(), v.z()}; };
  return Json{{"position_m", vector(camera.position)},
              {"forward", vector(camera.forward)},
              {"up", vector(camera.up)},
              {"vertical_field_of_view_rad", camera.field_of_view},
              {"barrel", camera.barrel}}
      .dump();
}

}  // namespace

Result<std::set<Pass>> passes_of(const std::vector<std::string>& names) {
  std::set<Pass> passes;
  Error error;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(kNames, std::string_view(name),
                                         [](const auto& known) { return known.second; });
    if (found != kNames.end()) {
      passes.insert(found->first);
      continue;
    }
    std::string known;
    for (const auto& [pass, text] : kNames)
      known += fmt::format("{}{}", known.empty() ? "" : ", ", text);
    error.messages.push_back(
        fmt::format("--passes: found \"{}\", expected names out of {}", name, known));
  }
  if (!error.messages.empty()) return std::unexpected(error);
  return passes;
}

PassContext pass_context(const FrameView& view, std::string scene, double time, bool with_smoke) {
  return {std::move(scene), label_table(view), camera_text(view.camera), time, with_smoke};
}

ExrPicture exr_of(const std::set<Pass>& wanted, const PassImages& images,
                  const PassContext& context) {
  std::set<Pass> passes = wanted;
  if (passes.contains(Pass::kBeauty) && context.with_smoke) passes.insert(Pass::kScattered);
  ExrPicture picture;
  picture.width = images.width;
  picture.height = images.height;
  std::string legend =
      "Ground truth of one picture: before exposure, spill of light, film curve and the sensor, "
      "and "
      "before the lens's distortion (a pinhole at `camera`), at the resolution that was shaded.\n";
  for (const Pass pass : passes) {
    add_pass(picture, pass, images);
    legend += fmt::format("{}\n", legend_of(pass));
  }
  picture.texts = {{"comments", legend},
                   {"scene", context.scene},
                   {"camera", context.camera},
                   {"software", "viscera"}};
  if (passes.contains(Pass::kLabels)) picture.texts.emplace_back("labels", context.labels);
  picture.numbers = {{"time_s", context.time}};
  return picture;
}

void PassWriter::write(const std::filesystem::path& file, std::shared_ptr<const PassImages> images,
                       PassContext context) {
  worker_.add([this, file, images = std::move(images), context = std::move(context)] {
    return write_exr(file, exr_of(passes_, *images, context));
  });
}

}  // namespace viscera
