# A sky of skyloom around a scene of Godot 4 and its sun as a light. Put it on a node; the scene needs nothing else.
# x east, y up, z south (axes=godot). Light is in kcd/m2 and klx; the camera's exposure brings it to the screen.
extends Node3D

@export var server := "http://127.0.0.1:8080"
@export_file("*.json") var scene_file := ""
@export var size := 512
@export var time_s := 0.0
# Of a sunlit cloud of 20 kcd/m2: about white.
@export var exposure := 0.05


func _ready() -> void:
	var scene = {}
	if scene_file != "":
		scene = JSON.parse_string(FileAccess.get_file_as_string(scene_file))
	var document := {"scene": scene, "time": time_s, "textures": ["sky.f16?axes=godot&size=%d" % size]}
	var request := HTTPRequest.new()
	add_child(request)
	request.request_completed.connect(_on_reply)
	request.request(server + "/v1/render", ["Content-Type: application/json"], HTTPClient.METHOD_POST, JSON.stringify(document))


func _on_reply(_result: int, status: int, _headers: PackedStringArray, body: PackedByteArray) -> void:
	if status != 200:
		push_error("skyloom: %d %s" % [status, body.get_string_from_utf8()])
		return
	var path := "user://skyloom.zip"
	var file := FileAccess.open(path, FileAccess.WRITE)
	file.store_buffer(body)
	file.close()
	var archive := ZIPReader.new()
	archive.open(path)
	var index = JSON.parse_string(archive.read_file("index.json").get_string_from_utf8())
	var shape = index["textures"][0]["shape"]
	# Raw half floats, top row first, as Godot has them.
	var image := Image.create_from_data(int(shape[1]), int(shape[0]), false, Image.FORMAT_RGBH, archive.read_file("sky.f16"))
	archive.close()

	var panorama := PanoramaSkyMaterial.new()
	panorama.panorama = ImageTexture.create_from_image(image)
	var environment := Environment.new()
	environment.background_mode = Environment.BG_SKY
	environment.sky = Sky.new()
	environment.sky.sky_material = panorama
	environment.ambient_light_source = Environment.AMBIENT_SOURCE_SKY
	environment.reflected_light_source = Environment.REFLECTION_SOURCE_SKY
	environment.tonemap_mode = Environment.TONE_MAPPER_FILMIC
	environment.tonemap_exposure = exposure
	var world := WorldEnvironment.new()
	world.environment = environment
	add_child(world)

	var told = index["sun"]
	var east_north_up = told["direction"]
	var towards := Vector3(east_north_up[0], east_north_up[2], -east_north_up[1])
	if towards.y <= 0.0:
		return
	var beam = told["irradiance"]["facing_the_sun"]
	var light := DirectionalLight3D.new()
	# A light shines along its -z. Without physical units Godot multiplies its energy by pi.
	var up := Vector3.UP if absf(towards.y) < 0.999 else Vector3.FORWARD
	light.basis = Basis.looking_at(-towards, up)
	var most: float = maxf(beam[0], maxf(beam[1], beam[2]))
	light.light_energy = most / PI
	# Colours of lights are given as sRGB.
	light.light_color = Color(beam[0] / most, beam[1] / most, beam[2] / most).linear_to_srgb()
	light.light_angular_distance = told["angular_diameter_deg"]
	light.shadow_enabled = true
	add_child(light)
