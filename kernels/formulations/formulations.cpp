#include "kernels/formulations/formulations.h"

#include <algorithm>

#include "kernels/paff/galerkin.h"
#if VISCERA_BASELINES
#include "kernels/baselines/strong_forms/collocation.h"
#endif

namespace viscera {
namespace {

std::vector<const Formulation*> formulations() {
  return {
    &galerkin_formulation(), &galerkin_quadratic_formulation(),
#if VISCERA_BASELINES
        &gfdm_formulation(), &paper_formulation()
#endif
  };
}

}  // namespace

const Formulation* find_formulation(std::string_view name) {
  for (const Formulation* formulation : formulations()) {
    if (formulation->name() == name) return formulation;
  }
  return nullptr;
}

std::vector<std::string> formulation_names() {
  std::vector<std::string> names;
  for (const Formulation* formulation : formulations()) names.emplace_back(formulation->name());
  return names;
}

std::vector<std::string> left_out_formulations() {
  std::vector<std::string> names;
  for (const char* published : {"gfdm", "paper"})
    if (!find_formulation(published)) names.emplace_back(published);
  return names;
}

std::string why_left_out(std::string_view name) {
  return "\"" + std::string(name) +
         "\" is one of the published formulations, which aren't built in; expected a build with "
         "MUMPS (tools/setup installs it) and VISCERA_BASELINES=ON";
}

std::string unknown_formulation(std::string_view name) {
  std::string text = "found \"" + std::string(name) + "\", expected one of ";
  const std::vector<std::string> names = formulation_names();
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : ", ") + names[i];
  const std::vector<std::string> absent = left_out_formulations();
  if (std::find(absent.begin(), absent.end(), name) != absent.end())
    text += ": " + why_left_out(name);
  return text;
}

}  // namespace viscera
