{% if cookiecutter.what != "pair" and "robot" in cookiecutter.__kinds %}
{{ partial("robot.py") -}}
{% endif %}
