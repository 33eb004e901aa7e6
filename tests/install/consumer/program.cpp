// Somebody else's program: two simulations of one model under different controls.
#include <engine/features/deformation/deformation_flags.h>
#include <viscera.h>

#include <cstdio>
#include <cstdlib>

template <class T>
T need(viscera::Result<T> result) {
  if (result) return *std::move(result);
  std::fprintf(stderr, "%s\n", result.error().text().c_str());
  std::exit(1);
}

int main(int, char** argv) {
  const viscera::Model model = need(viscera::Model::load(argv[1], {.assets = argv[2]}));
  auto calm = need(viscera::Simulation::create(model));
  auto deep = need(viscera::Simulation::create(model));
  for (int frame = 0; frame < 60; ++frame) {
    for (const std::string_view flag : calm.step().flags.names())
      if (flag != viscera::kBeyondLinear.name) {
        std::printf("a calm step raised %s\n", flag.data());
        return 1;
      }
    viscera::Controls controls = deep.path_controls();
    controls.tools[0].tip.z() -= 0.5e-3;
    need(deep.step(controls));
  }
  std::printf("%s: %.3f N and %.3f N\n", model.name().c_str(), calm.force(0).norm(),
              deep.force(0).norm());
  if (calm.hash() == deep.hash()) return 1;
  const viscera::Snapshot moment = need(deep.snapshot());
  for (int frame = 0; frame < 30; ++frame) deep.step();
  const std::string end = deep.hash();
  if (!deep.restore(moment)) return 1;
  for (int frame = 0; frame < 30; ++frame) deep.step();
  std::printf("after a snapshot of %zu bytes: %s\n", moment.bytes(),
              deep.hash() == end ? "the same hash" : "ANOTHER HASH");
  return deep.hash() == end ? 0 : 1;
}
