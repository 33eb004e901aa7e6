#include "tools/stress/drawn_scene.h"

#include <fstream>

namespace viscera {

nlohmann::json listed(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

Result<void> write_drawn_scene(const nlohmann::json& scene, const std::filesystem::path& file) {
  std::ofstream out(file);
  out << scene.dump(1) << '\n';
  out.close();
  if (!out) return failure(file.string() + ": can't be written");
  return {};
}

}  // namespace viscera
