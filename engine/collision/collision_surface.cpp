#include "engine/collision/collision_surface.h"

#include <embree3/rtcore.h>
#include <oneapi/tbb/task_arena.h>

#include <atomic>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>

#include "kernels/points/closest_on_triangle.h"

namespace viscera {
namespace {

/// Ways flatter over a triangle than this cosine meet it where single precision says.
constexpr double kGrazing = 1e-3;

/// One Embree device for the process, made when the first surface is. It isn't told a number of
/// threads: Embree would hold all of this process's TBB loops to it.
RTCDevice device() {
  static const RTCDevice shared = [] {
    RTCDevice made = rtcNewDevice("set_affinity=0");
    if (!made) throw std::runtime_error("Embree can't start on this processor");
    return made;
  }();
  return shared;
}

/// Embree fails for lack of memory or for a mistake of ours; neither can be gone on from.
void check_embree() {
  const RTCError error = rtcGetDeviceError(device());
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  if (error != RTC_ERROR_NONE)
    throw std::runtime_error("Embree reports error " + std::to_string(static_cast<int>(error)));
}

/// Builds or fits the hierarchy on this thread alone: the same tree for any number of threads, and
/// none that waits for it takes up other work meanwhile, which may need the same hierarchy.
void commit(RTCScene scene) {
  oneapi::tbb::task_arena alone(1);
  alone.execute([&] { rtcCommitScene(scene); });
}

}  // namespace

struct CollisionSurface::Data {
  std::vector<std::array<int, 3>> triangles;
  std::vector<Vec3f> positions;
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;
  float* vertex_buffer = nullptr;
  std::atomic<bool> moved = false;  // since the hierarchy was fitted
  std::mutex fitting;

  ~Data() {
    if (scene) rtcReleaseScene(scene);
    if (geometry) rtcReleaseGeometry(geometry);
  }

  Vec3 corner(int triangle, int c) const {
    return positions[static_cast<std::size_t>(triangles[static_cast<std::size_t>(triangle)]
                                                       [static_cast<std::size_t>(c)])]
        .cast<double>();
  }
  Hit hit_at(int triangle, const Vec3& weights, double distance) const {
    Hit hit;
    hit.point = {triangle, weights};
    hit.position = weights[0] * corner(triangle, 0) + weights[1] * corner(triangle, 1) +
                   weights[2] * corner(triangle, 2);
    hit.distance = distance;
    return hit;
  }
  /// Most updates of a surface pass without a question: the first one after it pays for the refit.
  void fit() {
    if (!moved.load(std::memory_order_acquire)) return;
    const std::lock_guard lock(fitting);
    if (!moved.load(std::memory_order_relaxed)) return;
    rtcUpdateGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry);
    commit(scene);
    moved.store(false, std::memory_order_release);
  }
  void copy_positions(std::span<const Vec3f> from) {
    positions.assign(from.begin(), from.end());
    for (std::size_t v = 0; v < positions.size(); ++v)
      for (int c = 0; c < 3; ++c)
        vertex_buffer[3 * v + static_cast<std::size_t>(c)] = positions[v][c];
  }
};

CollisionSurface::CollisionSurface(const TriangleSurface& rest, std::span<const Vec3f> positions)
    : data_(std::make_unique<Data>()) {
  Data& d = *data_;
  d.triangles = rest.triangles;
  d.scene = rtcNewScene(device());
  rtcSetSceneFlags(d.scene, RTC_SCENE_FLAG_DYNAMIC | RTC_SCENE_FLAG_ROBUST);
  // Of any other quality the scene is built anew whenever a geometry was refitted.
  rtcSetSceneBuildQuality(d.scene, RTC_BUILD_QUALITY_LOW);
  d.geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
  // REFIT keeps the tree and moves its boxes: right as long as the triangles stay the same.
  rtcSetGeometryBuildQuality(d.geometry, RTC_BUILD_QUALITY_REFIT);
  d.vertex_buffer = static_cast<float*>(
      rtcSetNewGeometryBuffer(d.geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                              3 * sizeof(float), positions.size()));
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(d.geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), d.triangles.size()));
  check_embree();
  for (std::size_t t = 0; t < d.triangles.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c)
      indices[3 * t + c] = static_cast<unsigned>(d.triangles[t][c]);
  check_embree();
  d.copy_positions(positions);
  rtcCommitGeometry(d.geometry);
  rtcAttachGeometryByID(d.scene, d.geometry, 0);
  commit(d.scene);
  check_embree();
}

CollisionSurface::~CollisionSurface() = default;
CollisionSurface::CollisionSurface(CollisionSurface&&) noexcept = default;
CollisionSurface& CollisionSurface::operator=(CollisionSurface&&) noexcept = default;

void CollisionSurface::update(std::span<const Vec3f> positions) {
  data_->copy_positions(positions);
  data_->moved.store(true, std::memory_order_release);
}

std::optional<CollisionSurface::Hit> CollisionSurface::closest(
    const Vec3& query, double radius, const std::function<bool(const Hit&)>& accepts) const {
  data_->fit();
  struct Search {
    const Data* data;
    Vec3 query;
    double best;
    const std::function<bool(const Hit&)>& accepts;
    int triangle = -1;
    Vec3 weights = Vec3::Zero();
  } search{data_.get(), query, radius, accepts};

  RTCPointQuery point;
  point.x = static_cast<float>(query.x());
  point.y = static_cast<float>(query.y());
  point.z = static_cast<float>(query.z());
  point.time = 0.0f;
  point.radius = static_cast<float>(radius);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(
      data_->scene, &point, &context,
      [](RTCPointQueryFunctionArguments* args) {
        auto& s = *static_cast<Search*>(args->userPtr);
        const int t = static_cast<int>(args->primID);
        const Vec3 a = s.data->corner(t, 0), b = s.data->corner(t, 1), c = s.data->corner(t, 2);
        const Vec3 w = closest_weights(s.query, a, b, c);
        const double distance = (w[0] * a + w[1] * b + w[2] * c - s.query).norm();
        // Ties go to the lower triangle, so that the result doesn't depend on the tree.
        if ((distance < s.best || (distance == s.best && t < s.triangle)) &&
            (!s.accepts || s.accepts(s.data->hit_at(t, w, distance)))) {
          s.best = distance;
          s.triangle = t;
          s.weights = w;
          args->query->radius = static_cast<float>(distance * (1.0 + 1e-6));
          return true;
        }
        return false;
      },
      &search);
  if (search.triangle < 0) return std::nullopt;
  return data_->hit_at(search.triangle, search.weights, search.best);
}

std::optional<CollisionSurface::Hit> CollisionSurface::cast(const Vec3& origin,
                                                            const Vec3& direction, double length,
                                                            bool exits) const {
  data_->fit();
  double start = 0.0;
  // A crossing of the wrong side is stepped over; a body is crossed a few times at most.
  for (int crossing = 0; crossing < 16; ++crossing) {
    RTCRayHit ray;
    ray.ray.org_x = static_cast<float>(origin.x());
    ray.ray.org_y = static_cast<float>(origin.y());
    ray.ray.org_z = static_cast<float>(origin.z());
    ray.ray.dir_x = static_cast<float>(direction.x());
    ray.ray.dir_y = static_cast<float>(direction.y());
    ray.ray.dir_z = static_cast<float>(direction.z());
    ray.ray.tnear = static_cast<float>(start);
    ray.ray.tfar = static_cast<float>(length);
    ray.ray.time = 0.0f;
    ray.ray.mask = 0xffffffffu;
    ray.ray.id = 0;
    ray.ray.flags = 0;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(data_->scene, &context, &ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    const int t = static_cast<int>(ray.hit.primID);
    const Vec3 a = data_->corner(t, 0), b = data_->corner(t, 1), c = data_->corner(t, 2);
    const Vec3 across = (b - a).cross(c - a);
    const double through = across.dot(direction);
    if ((through > 0.0) == exits) {
      // Embree says which triangle, in single precision; where on it is found in double: places
      // that jump by what that rounds would leave a tool's force undecided.
      const double u = ray.hit.u, v = ray.hit.v;
      if (!(std::abs(through) > kGrazing * across.norm()))
        return data_->hit_at(t, Vec3(1.0 - u - v, u, v), ray.ray.tfar);
      const double way = across.dot(a - origin) / through;
      return data_->hit_at(t, closest_weights(origin + way * direction, a, b, c), way);
    }
    start = static_cast<double>(ray.ray.tfar) + 1e-6;
  }
  return std::nullopt;
}

}  // namespace viscera
