/// \file
/// The table of cases: scene, what resolution counts, which resolutions are run where.
#include "tools/validation/observers.hpp"

namespace decant {

const std::vector<ValidationCase>& validation_cases() {
  // Resolutions: what a GPU runs unasked; the finest that the host runs unasked; the one of --quick.
  static const std::vector<ValidationCase> all = {
      {"free-fall", "A stretched ball in free fall keeps the path of its centre", "exact",
       "validate-free-fall.json", 0.1, {5, 10, 20}, 10, 10, observe_free_fall},
      {"still-tank", "Water that stands in a tank", "hydrostatics", "validate-still-tank.json", 0.1,
       {10, 20, 40}, 20, 20, observe_still_water},
      {"still-cup", "Water that stands in a cup", "hydrostatics", "validate-still-cup.json", 0.07,
       {10, 20, 40}, 20, 0, observe_still_water},
      {"couette", "Start-up of the flow between a plate at rest and one that moves",
       "Morris, Fox & Zhu 1997, eq. 28", "validate-couette.json", 0.02, {10, 20, 40}, 20, 20,
       observe_couette},
      {"poiseuille", "Start-up of the flow that a body force drives between plates",
       "Morris, Fox & Zhu 1997, eq. 24", "validate-poiseuille.json", 0.02, {10, 20, 40}, 20, 20,
       observe_poiseuille},
      {"drop", "A drop that is stretched, without gravity", "Monaghan 1994, eq. 5.1",
       "validate-drop.json", 1.0, {20, 40, 80}, 40, 20, observe_drop},
      {"dam-front", "A column collapses: its front and its height",
       "Martin & Moyce 1952; Koshizuka & Oka 1996", "validate-dam-front.json", 0.05715, {10, 20, 40},
       20, 0, observe_dam_front},
      {"dam-wall", "A column collapses: pressure on the far wall",
       "Lobovský et al. 2014; Buchner 2002", "validate-dam-wall.json", 0.3, {30, 60, 90}, 30, 0,
       observe_dam_wall},
      {"dam-obstacle", "A column collapses: pressure on an obstacle",
       "Kleefsman et al. 2005 (SPHERIC test 2)", "validate-dam-obstacle.json", 0.55, {20, 40, 60}, 20,
       0, observe_dam_obstacle},
      {"slit", "Outflow through a slit", "Torricelli; Kirchhoff 1869", "validate-slit.json", 0.02,
       {8, 16, 24}, 8, 0, observe_slit},
      {"slow-pour", "What a cup holds when it leans", "exact: the water below the lip",
       "validate-slow-pour.json", 0.035, {10, 20, 30}, 0, 0, observe_slow_pour},
  };
  return all;
}

}  // namespace decant
