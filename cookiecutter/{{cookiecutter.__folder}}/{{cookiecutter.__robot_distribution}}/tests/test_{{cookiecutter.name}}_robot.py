{% if cookiecutter.what == "pair" %}
{{ partial("test_robot.py", distribution=cookiecutter.__robot_distribution, package=cookiecutter.__robot_package, kinds="robot") -}}
{% endif %}
