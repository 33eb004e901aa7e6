// A page about one imported organ: figures of quality and what will go wrong before it does.
#pragma once

#include <string>
#include <vector>

namespace viscera {

struct OrganPage {
  std::string title, source;
  struct Figure {
    std::string what, value, remark;  ///< remark: where, or against what
    bool bad = false;
  };
  std::vector<Figure> figures;
  std::vector<std::string> warnings;
  struct Picture {
    std::string caption, uri;
  };
  std::vector<Picture> pictures;
  std::string entry;  ///< the organ's entry for a scene file
};

/// HTML in one file, without network and scripts.
std::string page_text(const OrganPage& page);

}  // namespace viscera
