{% if cookiecutter.what != "pair" and "robot" in cookiecutter.__kinds %}
{{ partial("test_robot.py", distribution=cookiecutter.__folder, package=cookiecutter.__package, kinds=cookiecutter.__kinds) -}}
{% endif %}
