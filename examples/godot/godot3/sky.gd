# A sky of skyloom in Godot 3: the panorama around, the ground with the clouds' shadow on it, and the sun as a light.
#   godot3-runner --path . --scene=SCENE.json [--server=http://127.0.0.1:8080] [--look=AZIMUTH,ELEVATION] [--from-above] [--picture=OUT.png]
# x east, y up, z south (axes=godot). Light is in kcd/m2 and klx; the environment's exposure brings it to the screen.
extends Spatial

# Of a sunlit cloud of 20 kcd/m2: bright, but not white.
const EXPOSURE := 0.03
const ALBEDO := 0.2
var given := {"server": "http://127.0.0.1:8080", "scene": "", "look": "0,15", "picture": ""}
var from_above := false
var id := ""
var extent := 20000.0


func _ready() -> void:
	for argument in OS.get_cmdline_args():
		var parts = argument.trim_prefix("--").split("=", true, 1)
		if given.has(parts[0]) and parts.size() == 2:
			given[parts[0]] = parts[1]
		from_above = from_above or argument == "--from-above"
	var file := File.new()
	if file.open(given.scene, File.READ) != OK:
		return fail("no scene " + given.scene)
	var answer = yield(ask("/v1/skies", file.get_as_text()), "completed")
	if answer == null:
		return
	var told = JSON.parse(answer.get_string_from_utf8()).result
	id = told.id
	extent = told.scene.domain.extent_m
	var panorama = yield(texture("sky.f16?axes=godot&size=512", 1024, 512, Image.FORMAT_RGBH), "completed")
	var shadow = yield(texture("shadow.f16?size=256", 256, 256, Image.FORMAT_RH), "completed")
	var sun = yield(ask("/v1/skies/%s/sun.json" % id), "completed")
	if panorama == null or shadow == null or sun == null:
		return
	show(panorama, shadow, JSON.parse(sun.get_string_from_utf8()).result)
	if given.picture != "":
		for _i in range(12):
			yield(get_tree(), "idle_frame")
		var shot := get_viewport().get_texture().get_data()
		shot.flip_y()
		shot.save_png(given.picture)
		get_tree().quit()


func fail(what: String) -> void:
	printerr("skyloom: ", what)
	OS.exit_code = 1
	get_tree().quit()


# The body of a reply, or null.
func ask(path: String, body := ""):
	var request := HTTPRequest.new()
	add_child(request)
	var method := HTTPClient.METHOD_POST if body != "" else HTTPClient.METHOD_GET
	request.request(given.server + path, ["Content-Type: application/json"], false, method, body)
	var reply = yield(request, "request_completed")
	request.queue_free()
	if reply[1] != 200 and reply[1] != 201:
		fail("%s: %d %s" % [path, reply[1], reply[3].get_string_from_utf8()])
		return null
	return reply[3]


# Raw half floats, top row first, as Godot has them.
func texture(path: String, width: int, height: int, format: int):
	var bytes = yield(ask("/v1/skies/%s/%s" % [id, path]), "completed")
	if bytes == null:
		return null
	var image := Image.new()
	image.create_from_data(width, height, false, format, bytes)
	var made := ImageTexture.new()
	made.create_from_image(image, Texture.FLAG_FILTER | Texture.FLAG_REPEAT)
	return made


func show(panorama: Texture, shadow: Texture, sun: Dictionary) -> void:
	var sky := PanoramaSky.new()
	sky.panorama = panorama
	sky.radiance_size = Sky.RADIANCE_SIZE_256
	var environment := Environment.new()
	environment.background_mode = Environment.BG_SKY
	environment.background_sky = sky
	environment.ambient_light_sky_contribution = 1.0
	environment.ambient_light_energy = 1.0
	environment.tonemap_mode = Environment.TONE_MAPPER_FILMIC
	environment.tonemap_exposure = EXPOSURE
	var world := WorldEnvironment.new()
	world.environment = environment
	add_child(world)

	var d = sun.direction
	var towards := Vector3(d[0], d[2], -d[1])
	var beam = sun.irradiance.facing_the_sun
	var most: float = max(beam[0], max(beam[1], beam[2]))
	if towards.y > 0.0 and most > 0.0:
		var light := DirectionalLight.new()
		light.look_at_from_position(Vector3.ZERO, -towards, Vector3.UP if abs(towards.y) < 0.999 else Vector3.FORWARD)
		# The ground below takes the beam with the clouds' shadow by its own shader; the light is for what stands on it.
		light.light_energy = most / PI
		light.light_color = Color(beam[0] / most, beam[1] / most, beam[2] / most)
		add_child(light)

	# The ground: the beam through the map of shadow, north on its upper edge, and the ambient light of the sky.
	var shader := Shader.new()
	shader.code = """shader_type spatial; render_mode unshaded, cull_disabled;
uniform sampler2D shadow; uniform vec3 beam; uniform vec3 ambient; uniform float extent; varying vec3 place;
void vertex() { place = (WORLD_MATRIX * vec4(VERTEX, 1.)).xyz; }
void fragment() { ALBEDO = (ambient + beam * texture(shadow, place.xz / extent + .5).r) * %f / 3.14159265; }""" % ALBEDO
	var material := ShaderMaterial.new()
	material.shader = shader
	var sky_light = sun.irradiance.sky
	material.set_shader_param("shadow", shadow)
	material.set_shader_param("beam", Vector3(beam[0], beam[1], beam[2]) * max(0.0, towards.y))
	material.set_shader_param("ambient", Vector3(sky_light[0], sky_light[1], sky_light[2]))
	material.set_shader_param("extent", extent)
	var plane := PlaneMesh.new()
	plane.size = Vector2(9, 9) * extent
	plane.material = material
	var ground := MeshInstance.new()
	ground.mesh = plane
	add_child(ground)

	var camera := Camera.new()
	camera.far = 5e5
	camera.near = 1.0
	add_child(camera)
	if from_above:
		# North on top, the domain from edge to edge.
		camera.set_orthogonal(extent, 1.0, 5e4)
		camera.look_at_from_position(Vector3(0, 2e4, 0), Vector3.ZERO, Vector3.FORWARD)
	else:
		var look = given.look.split_floats(",")
		camera.set_perspective(60.0, 0.5, 5e5)
		camera.translation = Vector3(0, 2, 0)
		camera.rotation_degrees = Vector3(look[1], -look[0], 0)
	camera.current = true
