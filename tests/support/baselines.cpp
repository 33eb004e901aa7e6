#include "tests/support/baselines.h"

namespace viscera::test {

bool strong_forms_built_in() {
  return VISCERA_BASELINES;
}

}  // namespace viscera::test
