#include "engine/features/contact/make_contact.h"

#include "engine/features/local/local.h"
#include "kernels/contact/patch_contact.h"
#include "kernels/hive/hive_contact.h"

namespace viscera {

std::unique_ptr<TissueContact> make_contact(const SceneModel& model, Entity organ) {
  const OrganModel& body = *model.constants().all<OrganBody>().find(organ)->model;
  if (body.finite) return make_finite_contact(body);
  if (body.touchable_anywhere()) {
    auto prepared = std::make_unique<PatchContact>(body.compliance, body.touchable, body.material);
    prepared->draw_on(body.drawn, body.in_half_precision() ? &body.half_columns : nullptr);
    return prepared;
  }
  const LocalBody* local = model.constants().all<LocalBody>().find(organ);
  if (!local) return nullptr;
  // The settings were sound when the model was made.
  auto hives = HiveContact::create(*local->walkable, local->hive);
  return hives ? std::move(*hives) : nullptr;
}

std::unique_ptr<FiniteContact> make_finite_contact(const OrganModel& body) {
  auto finite = std::make_unique<FiniteContact>(
      FiniteResponse{body.compliance, body.step_compliance, body.touchable, body.places,
                     *body.finite, body.hold_loads},
      body.material);
  finite->draw_on(body.drawn, nullptr);
  return finite;
}

}  // namespace viscera
