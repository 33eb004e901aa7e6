#include "kernels/smoke/smoke_book.h"

#include <cmath>

namespace viscera {

void SmokeBook::flow_out(double volume, double evacuation, double leak, double dt) {
  const double flow = evacuation + leak;
  if (!(flow > 0.0) || !(volume > 0.0) || !(background > 0.0)) return;
  const double gone = -background * std::expm1(-flow * dt / volume);
  const double sucked = gone * (evacuation / flow);
  background -= gone;
  evacuated += sucked;
  leaked += gone - sucked;
}

}  // namespace viscera
