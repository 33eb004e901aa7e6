#include "tests/engine/scene/scene_fixture.h"

#include <algorithm>
#include <fstream>

#include "engine/features/features.h"

namespace viscera::test {

namespace fs = std::filesystem;

SceneFolder::SceneFolder() {
  fs::create_directories(path() / "assets/organs");
  fs::copy_file(project_file("assets/tissues.json"), path() / "assets/tissues.json");
  write("assets/organs/liver.json", "{}");
  write("assets/organs/kidney.json", "{}");
  write("ball.obj", "v 0 0 0\n");
  write("map.nii", "not read here");
  options.assets = path() / "assets";
  options.features = feature_keys();
}

fs::path SceneFolder::write(const std::string& name, const std::string& text) const {
  const fs::path file = path() / name;
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

Result<SceneDescription> SceneFolder::load_text(const std::string& text) const {
  return load_scene(write("scene.json", text), options);
}

std::vector<std::string> SceneFolder::mistakes(const Json& scene) const {
  const Result<SceneDescription> loaded = load(scene);
  if (loaded) return {};
  std::vector<std::string> messages = loaded.error().messages;
  const std::string prefix = (path() / "scene.json").string() + ": ";
  for (std::string& message : messages)
    if (message.starts_with(prefix)) message = message.substr(prefix.size());
  return messages;
}

std::vector<std::string> mistakes_with(const std::string& pointer, const Json& value) {
  Json scene = whole_scene();
  scene[Json::json_pointer(pointer)] = value;
  return SceneFolder().mistakes(scene);
}

std::string all(const std::vector<std::string>& messages) {
  std::string text;
  for (const std::string& message : messages) text += message + "\n";
  return text;
}

bool mentions(const std::vector<std::string>& messages, const std::string& path,
              const std::vector<std::string>& parts) {
  return std::count_if(messages.begin(), messages.end(), [&](const std::string& message) {
           return message.starts_with(path + ": ") &&
                  std::all_of(parts.begin(), parts.end(), [&message](const std::string& part) {
                    return message.find(part) != std::string::npos;
                  });
         }) == 1;
}

}  // namespace viscera::test
