// Which kind of tissue answers for an organ.
#pragma once

#include <memory>

#include "engine/simulation/model.h"
#include "kernels/contact/finite_contact.h"
#include "kernels/contact/tissue_contact.h"

namespace viscera {

/// By its prepared compliance; by its energy where its response is finite, by hives alone where it
/// is local; null where nothing can touch it. The model outlives it.
std::unique_ptr<TissueContact> make_contact(const SceneModel& model, Entity organ);
/// Of a body at finite strain.
std::unique_ptr<FiniteContact> make_finite_contact(const OrganModel& body);

}  // namespace viscera
