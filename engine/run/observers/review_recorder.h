// Watches a run for its review.html: curves, moments with their pictures, greatest displacements.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/io/forces_csv.h"
#include "engine/io/review.h"
#include "engine/io/trace.h"
#include "engine/run/observer.h"
#include "engine/scene/scene.h"

namespace viscera {

/// How deep each instrument's tip is in the tissue's shape at rest [m]; 0 where it doesn't press,
/// and for closed jaws, which carry their tissue along.
std::vector<double> penetrations(const World& world);

class ReviewRecorder : public Observer {
 public:
  /// `trace`: of the run, asked at its end. `film`: beside the page, if pictures were drawn; empty:
  /// there is none. `pictures`: the run draws some.
  ReviewRecorder(const World& world, const SceneDescription& scene, const Trace& trace,
                 std::string film, bool pictures);

  Result<void> open(const std::filesystem::path& folder) override;
  void add_frame(const World& world) override;
  /// Moments since the last picture get this one.
  Result<void> add_picture(FrameViews& views) override;
  /// Fills in what the run showed of the organs.
  void describe(const World& world, RunReport& report) const override;
  /// review.html.
  Result<void> present(const RunReport& report) override;
  Result<void> save_state(ByteWriter& writer) override;
  Result<void> load_state(ByteReader& reader) override;

  void take(const World& world, const Picture& picture);
  /// What the page shows. Fails where a picture can't be encoded.
  Result<Review> review(const RunReport& report) const;

 private:
  /// A moment, as far as it is known.
  struct Watched {
    std::string detail;
    std::uint64_t frame = 0;  ///< 0: hasn't come
    double time = 0.0;        ///< [s]
    double greatest = 0.0;    ///< of those that something surpasses
    bool wants_picture = false;
    std::optional<Thumbnail> picture;
    static constexpr auto fields() {
      return std::tuple(field("detail", &Watched::detail), field("frame", &Watched::frame),
                        field("time", &Watched::time), field("greatest", &Watched::greatest),
                        field("wants_picture", &Watched::wants_picture),
                        field("picture", &Watched::picture));
    }

    void comes(const World& world, std::string what);
  };
  struct Moments {
    Watched contact, hold, force_peak, smoke, displacement_peak, first_parted, last_parted;
    static constexpr auto fields() {
      return std::tuple(field("contact", &Moments::contact), field("hold", &Moments::hold),
                        field("force_peak", &Moments::force_peak), field("smoke", &Moments::smoke),
                        field("displacement_peak", &Moments::displacement_peak),
                        field("first_parted", &Moments::first_parted),
                        field("last_parted", &Moments::last_parted));
    }
  };
  struct Curves {
    std::vector<Curve> force, penetration, displacement, links, bed_forces, bonds_parted, power,
        hottest, pressure;
    static constexpr auto fields() {
      return std::tuple(field("force", &Curves::force), field("penetration", &Curves::penetration),
                        field("displacement", &Curves::displacement),
                        field("links", &Curves::links), field("bed_forces", &Curves::bed_forces),
                        field("bonds_parted", &Curves::bonds_parted),
                        field("power", &Curves::power), field("hottest", &Curves::hottest),
                        field("pressure", &Curves::pressure));
    }
  };
  struct State {
    Curves curves;
    std::vector<double> greatest, greatest_time;  ///< of each organ [m], [s]
    Moments moments;
    static constexpr auto fields() {
      return std::tuple(field("curves", &State::curves), field("greatest", &State::greatest),
                        field("greatest_time", &State::greatest_time),
                        field("moments", &State::moments));
    }
  };

  void watch_contacts(const World& world);
  void watch_organs(const World& world);
  void watch_smoke(const World& world);
  void watch_heat(const World& world);
  void watch_gas(const World& world);
  void watch_beds(const World& world);
  std::array<Watched*, 7> watched();

  const Trace& trace_;
  StepRate steps_;
  std::string film_;
  std::filesystem::path folder_;
  std::vector<std::string> tools_;
  std::vector<std::optional<std::size_t>> curve_of_organ_;
  State state_;
};

}  // namespace viscera
