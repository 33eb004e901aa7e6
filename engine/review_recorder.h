// Watches a run for its review.html: curves, moments with their pictures, greatest displacements.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/io/forces_csv.h"
#include "engine/io/report.h"
#include "engine/io/review.h"
#include "engine/io/trace.h"
#include "engine/render/renderer.h"
#include "engine/scene/scene.h"
#include "engine/world.h"

namespace viscera {

/// How deep each instrument's tip is in the tissue's shape at rest [m]; 0 where it doesn't press,
/// and for closed jaws, which carry their tissue along.
std::vector<double> penetrations(const World& world);

class ReviewRecorder {
 public:
  ReviewRecorder(const World& world, const SceneDescription& scene);

  /// After every frame.
  void add_frame(const World& world, std::span<const TipSample> samples);
  /// After every picture. Moments since the last one get it.
  void add_picture(const World& world, const Picture& picture);

  /// Fills in what the run showed of the organs.
  void describe(RunReport& report) const;
  /// `film`: beside the page, or empty. Fails where a picture can't be encoded.
  Result<Review> finish(const Trace& trace, const RunReport& report, const std::string& film) const;

 private:
  /// A moment, as far as it is known.
  struct Watched {
    explicit Watched(std::string name) : title(std::move(name)) {}

    std::string title, detail;
    std::uint64_t frame = 0;  ///< 0: hasn't come
    double time = 0.0;        ///< [s]
    double greatest = 0.0;    ///< of those that something surpasses
    bool wants_picture = false;
    std::optional<Thumbnail> picture;

    void comes(const World& world, std::string what);
  };

  void watch_contacts(const World& world, std::span<const TipSample> samples);
  void watch_organs(const World& world);
  void watch_smoke(const World& world);
  void watch_heat(const World& world);

  std::vector<std::string> tools_;
  Chart force_, penetration_, displacement_, links_, power_, hottest_;
  std::vector<std::optional<std::size_t>> curve_of_organ_;
  std::vector<double> greatest_, greatest_time_;  ///< of each organ [m], [s]
  Watched contact_{"First contact"}, hold_{"Jaws first hold tissue"}, force_peak_{"Peak force"},
      smoke_{"First smoke"}, displacement_peak_{"Greatest displacement"};
};

}  // namespace viscera
