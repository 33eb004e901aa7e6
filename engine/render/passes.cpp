#include "engine/render/passes.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <limits>

#include "engine/render/shaders.h"

namespace viscera {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

/// A colour attachment of the framebuffer that reads are from, rows from the top.
template <class Value>
std::vector<Value> read(const Framebuffer& source, int attachment, unsigned format, unsigned type,
                        int components, int width, int height) {
  const std::size_t row = static_cast<std::size_t>(width) * static_cast<std::size_t>(components);
  std::vector<Value> values(row * static_cast<std::size_t>(height));
  source.bind();
  glReadBuffer(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(attachment));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, format, type, values.data());
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  for (int y = 0; y < height / 2; ++y) {
    const auto low = values.begin() + static_cast<std::ptrdiff_t>(row) * y;
    const auto high = values.begin() + static_cast<std::ptrdiff_t>(row) * (height - 1 - y);
    std::swap_ranges(low, low + static_cast<std::ptrdiff_t>(row), high);
  }
  return values;
}

std::vector<float> component(const std::vector<float>& rgba, std::size_t which) {
  std::vector<float> values(rgba.size() / 4);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = rgba[4 * i + which];
  return values;
}

}  // namespace

PassLayers::PassLayers(const Canvas& canvas) {
  const int width = canvas.radiance.width(), height = canvas.radiance.height();
  constexpr auto kNearest = Texture::Filter::kNearest;
  kept_ = Texture(GL_RGBA32F, width, height, 0, kNearest);
  scattered_ = Texture(GL_RGBA32F, width, height, 0, kNearest);
  label_ = Texture(GL_R32UI, width, height, 0, kNearest);
  temperature_ = Texture(GL_R32F, width, height, 0, kNearest);
  light = Framebuffer({&kept_, &scattered_}, nullptr);
  surface = Framebuffer({&label_, &temperature_}, &canvas.depth);
}

void PassLayers::clear_light() const {
  light.bind();
  const float kept[4] = {1.0f, 1.0f, kInfinite, kUnknown};
  const float none[4] = {0.0f, 0.0f, 0.0f, 0.0f};
  glClearBufferfv(GL_COLOR, 0, kept);
  glClearBufferfv(GL_COLOR, 1, none);
}

void PassLayers::read_clean(const Canvas& canvas, PassImages& images) {
  images.width = canvas.radiance.width();
  images.height = canvas.radiance.height();
  images.clean = read<float>(canvas.lit, 0, GL_RGB, GL_FLOAT, 3, images.width, images.height);
}

void PassLayers::read_back(const Canvas& canvas, PassImages& images) const {
  const int width = canvas.radiance.width(), height = canvas.radiance.height();
  images.beauty = read<float>(canvas.lit, 0, GL_RGB, GL_FLOAT, 3, width, height);
  const std::vector<float> kept = read<float>(light, 0, GL_RGBA, GL_FLOAT, 4, width, height);
  images.transmittance = component(kept, 0);
  images.light_transmittance = component(kept, 1);
  images.depth = component(kept, 2);
  images.smoke_temperature = component(kept, 3);
  images.scattered = read<float>(light, 1, GL_RGB, GL_FLOAT, 3, width, height);
  images.labels =
      read<std::uint32_t>(surface, 0, GL_RED_INTEGER, GL_UNSIGNED_INT, 1, width, height);
  images.surface_temperature = read<float>(surface, 1, GL_RED, GL_FLOAT, 1, width, height);
}

Result<LabelPass> LabelPass::create() {
  LabelPass pass;
  ProgramLoader load;
  load(pass.organ_, "organ.vert", "label.frag");
  load(pass.burnt_organ_, "organ.vert", "label.frag", {"BURNT"}, {"burn.glsl"});
  load(pass.instrument_, "instrument.vert", "label.frag");
  load(pass.strand_, "strand.vert", "label.frag");
  return load.give(std::move(pass));
}

void LabelPass::draw(const FrameView& view, const SceneBuffers& buffers, const Canvas& canvas,
                     const PassLayers& layers) {
  layers.surface.bind();
  const GLuint nothing[4] = {0, 0, 0, 0};
  const float unknown[4] = {kUnknown, 0.0f, 0.0f, 0.0f};
  glClearBufferuiv(GL_COLOR, 0, nothing);
  glClearBufferfv(GL_COLOR, 1, unknown);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_EQUAL);
  int label = 0;
  for (const OrganView& organ : view.organs) {
    const OrganBuffers& surface = buffers.organs.at(organ.id);
    const bool burnt = organ.burn != nullptr && surface.burn() != nullptr;
    Program& program = burnt ? burnt_organ_ : organ_;
    program.use();
    program.set("model", model_matrix(organ.pose));
    program.set("label", ++label);
    program.set("temperature", static_cast<float>(organ.temperature));
    if (burnt) surface.burn()->bind(program, kBrickMapUnit, kAtlasUnit);
    surface.draw(canvas, organ.pose);
  }
  for (const InstrumentView& instrument : view.instruments) {
    instrument_.use();
    instrument_.set("model", model_matrix(instrument));
    instrument_.set("label", ++label);
    instrument_.set("temperature", kUnknown);
    buffers.instruments.at(instrument.id).draw();
  }
  strand_.use();
  strand_.set("temperature", kUnknown);
  for (const BedView& bed : view.beds) {
    strand_.set("label", ++label);
    buffers.beds.at(bed.id).draw();
  }
  glDisable(GL_DEPTH_TEST);
}

}  // namespace viscera
