# What Homebrew gives a formula, as far as ours calls it: ruby homebrew_stand_in.rb FORMULA prints its fields as JSON, a line.
require "json"
class Formula
  FIELDS = %i[desc homepage url sha256 license].freeze
  @@found = { "depends_on" => [] }
  FIELDS.each { |field| define_singleton_method(field) { |value| @@found[field.to_s] = value } }
  def self.depends_on(what) = @@found["depends_on"] << (what.is_a?(Hash) ? what.keys.first : what)
  def self.test(&block) = @@found["test"] = !block.nil?
  def self.found = @@found
end
load ARGV[0]
commands = []
formula = Quadwright.new
formula.define_singleton_method(:system) { |*words| commands << words.join(" ") }
formula.define_singleton_method(:std_cmake_args) { ["-DCMAKE_INSTALL_PREFIX=PREFIX"] }
formula.install
puts JSON.generate(Formula.found.merge("class" => Quadwright.name, "install" => commands))
