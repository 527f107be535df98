# The Homebrew formula. The release workflow fills in the version and the checksums.
class Closecall < Formula
  desc "Closed-loop software-in-the-loop testbed for highway ADAS"
  homepage "@REPOSITORY@"
  version "@VERSION@"
  license any_of: ["MIT", "Apache-2.0"]

  on_macos do
    on_arm do
      url "@REPOSITORY@/releases/download/v@VERSION@/closecall-v@VERSION@-aarch64-apple-darwin.tar.gz"
      sha256 "@SHA256-aarch64-apple-darwin@"
    end
  end

  on_linux do
    on_intel do
      url "@REPOSITORY@/releases/download/v@VERSION@/closecall-v@VERSION@-x86_64-unknown-linux-gnu.tar.gz"
      sha256 "@SHA256-x86_64-unknown-linux-gnu@"
    end
    on_arm do
      url "@REPOSITORY@/releases/download/v@VERSION@/closecall-v@VERSION@-aarch64-unknown-linux-gnu.tar.gz"
      sha256 "@SHA256-aarch64-unknown-linux-gnu@"
    end
  end

  def install
    bin.install "closecall"
    man1.install Dir["man/*.1"]
    bash_completion.install "completions/closecall.bash" => "closecall"
    zsh_completion.install "completions/closecall.zsh" => "_closecall"
    fish_completion.install "completions/closecall.fish"
  end

  test do
    system bin/"closecall", "run", "low-thw-overtake", "--sensors", "object"
  end
end
