// Reference motion of rigid bodies with joints and gravity, without contact: Newton's and Euler's equations in maximal coordinates, the
// joints' forces found as Lagrange multipliers on the level of accelerations (Haug 1989, chapter 11), integrated to about twelve digits.
#pragma once

#include "apps/cli/truths.hpp"

namespace cairn::cli {

// States of all bodies of the scene at the given times (ascending, from 0); static ones stay. Contacts are not looked for.
std::vector<std::vector<BodyState>> mechanism_reference(const Scene& scene, const std::vector<Real>& times);

}  // namespace cairn::cli
