/** \file
 * What a solver built elsewhere offers to be judged: a shared library with one function, decant_plugin(). C99, nothing
 * to link. How to use it: oracle/plugin/README.md.
 *
 * SI units. Vectors are x, y, z of each particle, one after the other; a particle's id is its index, for life. Arrays
 * that are handed in stay the host's and are valid during the call. All calls come from one thread of a process that
 * is the plug-in's own.
 *
 * Growth: a struct that the host fills in begins with its size; later headers only append, and offer new abilities by new
 * bits. A table that is shorter than today's is taken as if the rest were null.
 */
#ifndef DECANT_PLUGIN_H
#define DECANT_PLUGIN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DECANT_PLUGIN_ABI 1

/** What a plug-in can be asked for. What it does not offer is left out of its verdict, and said. */
enum decant_offer {
  DECANT_OFFERS_DENSITY = 1u << 0,         /**< density and pressure */
  DECANT_OFFERS_ACCELERATION = 1u << 1,    /**< total acceleration, gravity included */
  DECANT_OFFERS_PARTS = 1u << 2,           /**< the four parts of it */
  DECANT_OFFERS_NEIGHBORS = 1u << 3,       /**< counts and sums of ids */
  DECANT_OFFERS_GIVEN = 1u << 4,           /**< accelerations from a density and pressure that are handed in */
  DECANT_OFFERS_BOUNDARY_VOLUME = 1u << 5, /**< volumes of wall particles */
  DECANT_OFFERS_WALLS = 1u << 6,           /**< scenes with wall particles */
  DECANT_OFFERS_STEP = 1u << 7,            /**< advance() and read() */
  DECANT_OFFERS_STATUS = 1u << 8,          /**< decant_status */
  DECANT_OFFERS_LISTS = 1u << 9,           /**< lists() */
  DECANT_OFFERS_REBUILD = 1u << 10         /**< options rebuild=N, skin=S (share of H); lists miss nothing without */
};

enum decant_kernel { DECANT_CUBIC_SPLINE = 0, DECANT_WENDLAND_C2 = 1, DECANT_MUELLER_2003 = 2 };

/** x_world = rotation x_local + translation; what is solid at x_world moves with
 * linear_velocity + surface_velocity + angular_velocity × (x_world − pivot). */
typedef struct decant_pose {
  double rotation[9]; /**< row by row */
  double translation[3];
  double pivot[3];            /**< m, world */
  double angular_velocity[3]; /**< rad/s */
  double linear_velocity[3];  /**< m/s, of the pivot */
  double surface_velocity[3]; /**< m/s, world */
} decant_pose;

/** Everything that changes the answer. */
typedef struct decant_scene {
  uint32_t size;
  int32_t kernel;          /**< decant_kernel */
  double particle_spacing; /**< dx */
  double support_radius;   /**< H, where kernels end */
  double particle_mass;    /**< m, of each fluid particle */
  double rest_density;     /**< rho0 */
  double sound_speed;      /**< c0 */
  double eos_exponent;     /**< gamma */
  double eos_stiffness;    /**< B = rho0 c0² / gamma, Pa */
  int32_t allow_tension;   /**< 0: p = max(p, 0) */
  int32_t containers;
  double viscosity;      /**< mu, Pa·s */
  double wall_viscosity; /**< mu_w, Pa·s */
  double gravity[3];
  double domain_min[3], domain_max[3];
  int32_t periodic[3]; /**< by axis; both ends are one place */
  int32_t has_floor;
  double floor_height;     /**< z of a plane without wall particles */
  double contact_distance; /**< from a solid, m */
  double restitution, friction;
  double time_step; /**< dt; time is substep × dt, never summed up */
  /** For the callbacks. */
  const void* host;
  /** Where container k is at a time, s. */
  void (*pose)(const void* host, int32_t k, double time, decant_pose* out);
  /** Signed distance, m, of a point in container k's frame from its solid, positive outside; normal: unit, outward. */
  double (*distance)(const void* host, int32_t k, const double point[3], double normal[3]);
} decant_scene;

typedef struct decant_walls {
  uint32_t size;
  uint32_t unused;
  int64_t count;
  const double* position;   /**< [count][3], m, in the frame of its container */
  const int32_t* container; /**< [count], not decreasing */
} decant_walls;

typedef struct decant_state {
  uint32_t size;
  uint32_t unused;
  int64_t count; /**< from 0 on */
  int64_t substep;
  const double* position; /**< [count][3], m; of fp32, as all recorded states are */
  const double* velocity; /**< [count][3], m/s */
} decant_state;

/** Inputs of later stages in place of what the plug-in would compute; null: not given. The pressure in decant_fields is
 * always that of the density in use, by the plug-in's equation of state: never the pressure that is given here. */
typedef struct decant_given {
  uint32_t size;
  uint32_t unused;
  const double* boundary_volume; /**< [walls], m³ */
  const double* density;         /**< [fluid], kg/m³ */
  const double* pressure;        /**< [fluid], Pa; comes with density */
} decant_given;

/** Where answers go. Reals arrive as NaN and integers as −1: what is not written shows. A particle is not its own
 * neighbor; pairs count where r < H. */
typedef struct decant_fields {
  uint32_t size;
  uint32_t unused;
  int64_t fluid, walls;
  double* boundary_volume;                               /**< [walls], m³ */
  double *density, *pressure;                            /**< [fluid] */
  double* acceleration;                                  /**< [fluid][3], m/s², with gravity */
  double* pressure_acceleration;                         /**< [fluid][3], fluid on fluid */
  double* viscous_acceleration;                          /**< [fluid][3], fluid on fluid */
  double* wall_pressure_acceleration;                    /**< [fluid][3] */
  double* wall_viscous_acceleration;                     /**< [fluid][3] */
  int64_t *fluid_neighbor_count, *fluid_neighbor_id_sum; /**< [fluid] */
  int64_t *wall_neighbor_count, *wall_neighbor_id_sum;   /**< [fluid] */
} decant_fields;

enum decant_status_bit { DECANT_NON_FINITE = 1, DECANT_ESCAPED = 2, DECANT_CAPACITY = 4, DECANT_MISSED_PAIR = 8 };

/** Trouble in a substep; arrives as none. */
typedef struct decant_status {
  uint32_t size;
  uint32_t bits;    /**< decant_status_bit */
  int64_t particle; /**< lowest id concerned */
  int64_t substep;  /**< first one it was seen after, counted as decant_state counts */
} decant_status;

/** The lists that the next substep uses. What it points to stays the plug-in's, until the next call. Entries in any
 * order; a pair of the fluid is in the lists of both its particles. */
typedef struct decant_lists {
  uint32_t size;
  uint32_t unused;
  int64_t built;                /**< substep of the state that they were built at */
  const int64_t* fluid_offsets; /**< [fluid + 1], from 0 on: list i is fluid[fluid_offsets[i] … fluid_offsets[i + 1]) */
  const int32_t* fluid;         /**< ids */
  const int64_t* wall_offsets;  /**< [fluid + 1] */
  const int32_t* wall;          /**< numbers of wall particles */
} decant_lists;

/** Since load(): seconds and timed passes per stage, and how often lists were built. Not all substeps need be timed. */
typedef struct decant_stage_times {
  uint32_t size;
  uint32_t unused;
  double build, density, force, integrate; /**< s */
  int64_t build_calls, density_calls, force_calls, integrate_calls;
  int64_t rebuilds;
} decant_stage_times;

/** Calls return 0, or anything else with last_error() saying why. Those that an offer does not need may be null. */
typedef struct decant_plugin_table {
  uint32_t abi;  /**< DECANT_PLUGIN_ABI */
  uint32_t size; /**< of this struct, where the plug-in was built */
  const char* name;
  const char* precision; /**< "fp32" or "fp64" */
  uint32_t offers;       /**< decant_offer, or'ed */
  uint32_t unused;
  /** \param options  what stood behind the path: "key=value:key=value", or "" */
  int (*create)(const char* options, void** solver);
  void (*destroy)(void* solver);
  /** Takes a scene and a state. Comes again and again, with others. */
  int (*load)(void* solver, const decant_scene*, const decant_walls*, const decant_state*);
  /** Fields of the present state. \param given  null: none. No later call may differ because of this one. */
  int (*evaluate)(void* solver, const decant_given* given, decant_fields*, decant_status*);
  /** So many substeps of dt onward. */
  int (*advance)(void* solver, int64_t substeps, decant_status*);
  /** \param position, velocity  [count][3] */
  int (*read)(void* solver, double* position, double* velocity);
  /** Of the call that failed; valid until the next one. solver may be null. */
  const char* (*last_error)(void* solver);
  /** What it runs on, for reports; may be null. */
  const char* (*device)(void* solver);
  /** Memory held on a device, bytes; may be null. */
  int64_t (*bytes)(void* solver);
  /** May be null without DECANT_OFFERS_LISTS. */
  int (*lists)(void* solver, decant_lists*);
  /** May be null. */
  int (*stage_times)(void* solver, decant_stage_times*);
} decant_plugin_table;

/** The one function that a plug-in exports. \param host_abi  DECANT_PLUGIN_ABI of the host
 * \return null: the plug-in cannot work with that host. */
#if defined(_WIN32)
#define DECANT_PLUGIN_EXPORT __declspec(dllexport)
#else
#define DECANT_PLUGIN_EXPORT __attribute__((visibility("default")))
#endif
DECANT_PLUGIN_EXPORT const decant_plugin_table* decant_plugin(uint32_t host_abi);

#ifdef __cplusplus
}
#endif

#endif
