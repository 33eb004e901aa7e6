// Which of the published methods this build holds.
#pragma once

namespace viscera::test {

/// The formulations gfdm and paper (VISCERA_BASELINES). Without them tests of theirs say skipped,
/// with this reason.
bool strong_forms_built_in();
inline constexpr const char* kNoStrongForms = "gfdm and paper aren't built in (no MUMPS)";

}  // namespace viscera::test
