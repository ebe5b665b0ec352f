# Formula/quadwright.rb of a tap (quadwright/homebrew-tap), or of homebrew-core once it is known enough.
class Quadwright < Formula
  desc "Any triangle surface in, a clean all-quad mesh out"
  homepage "https://github.com/quadwright/quadwright"
  url "https://github.com/quadwright/quadwright/releases/download/v0.1.0/quadwright-0.1.0-source.tar.gz"
  sha256 "0000000000000000000000000000000000000000000000000000000000000000"
  license "MIT"

  depends_on "cmake" => :build
  depends_on "ninja" => :build
  depends_on "webp"

  def install
    system "cmake", "-S", ".", "-B", "build", "-G", "Ninja", "-DQW_BUILD_TESTS=OFF", *std_cmake_args
    system "cmake", "--build", "build"
    system "cmake", "--install", "build"
  end

  test do
    (testpath/"tetrahedron.obj").write <<~EOS
      v 0 0 0
      v 1 0 0
      v 0 1 0
      v 0 0 1
      f 1 3 2
      f 1 2 4
      f 2 3 4
      f 3 1 4
    EOS
    system bin/"quadwright", "tetrahedron.obj", "-o", "quads.obj", "--faces", "50", "--quiet"
    assert_match(/^f \d+ \d+ \d+ \d+$/, (testpath/"quads.obj").read)
  end
end
