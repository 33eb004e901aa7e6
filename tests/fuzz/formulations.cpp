// In place of kernels/formulations/formulations.cpp, which brings every elastic method with it: the
// names are all that a scene's parser asks for.
#include "kernels/formulations/formulations.h"

namespace viscera {

std::vector<std::string> formulation_names() {
  return {"galerkin"};
}

std::vector<std::string> left_out_formulations() {
  return {"gfdm", "paper"};
}

std::string why_left_out(std::string_view) {
  return "a build with them";
}

}  // namespace viscera
